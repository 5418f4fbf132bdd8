@tool
extends RefCounted
## RTGI's light atlas: its texture, the uniforms of irradiance.gdshaderinc, and the same look-up for scripts.

const Volumes := preload("volumes.gd")

## Where the bake's own axes lie in the world: turned and moved, not scaled.
var world_from_local := Transform3D.IDENTITY
var texture: Texture3D
## What the numbers of the texture are over.
var scale := 1.0
## What relight.gd draws of it under other light, or null: it keeps the light of the bake. Beside it, for scripts, its tables (relit.gd)
## and what shines.
var shown: Texture2D
var relit: RefCounted
var rows := PackedFloat32Array()
var _parts := {}  # node name -> entry of the index
var _slices: Array[Image] = []
var _tables: Array[Image] = []


## Reads [param folder]/atlas.json and the texture that it names. An error names what is missing.
func open(folder: String) -> Error:
	var index := Volumes.index_of(folder, "atlas.json")
	if index.is_empty():
		return ERR_FILE_CANT_READ
	_parts.clear()
	for part: Dictionary in index["parts"]:
		# Meshes have two maps here; what lies in another is lit by the probes.
		if part["texcoord"] < 2:
			_parts[(part["name"] as String).validate_node_name()] = part
	_slices.clear()
	texture = Volumes.texture_of(folder, index["texels"])
	scale = index.get("scale", 1.0)
	return OK if texture != null else ERR_FILE_MISSING_DEPENDENCIES


## The name under which [param mesh] is in the atlas, or "": its node's, as the glTF importer makes it of Blender's.
func part_of(mesh: Node) -> String:
	var name := String(mesh.name)
	return name if _parts.has(name) else ""


## Sets the uniforms of [param material], whose shader includes irradiance.gdshaderinc and which the object [param part] alone has.
func apply_to(material: ShaderMaterial, part: String) -> void:
	var entry: Dictionary = _parts[part]
	material.set_shader_parameter("rtgi_atlas_place", Vector3(entry["scale"], entry["offset"][0], entry["offset"][1]))
	material.set_shader_parameter("rtgi_atlas_second", entry["texcoord"] == 1)
	material.set_shader_parameter("rtgi_atlas_local_from_world", Projection(world_from_local.affine_inverse()))
	material.set_shader_parameter("rtgi_atlas_texels", texture)
	material.set_shader_parameter("rtgi_atlas_scale", scale)
	if shown != null:
		material.set_shader_parameter("rtgi_atlas_shown", shown)
		material.set_shader_parameter("rtgi_atlas_relit", true)
	material.set_shader_parameter("rtgi_atlas_ready", texture != null)


## Irradiance [W/m^2] of the object [param part] at its map's coordinates, v down, under a normal.
func irradiance(part: String, st: Vector2, normal_world: Vector3) -> Color:
	if _slices.is_empty():
		_slices = Volumes.slices_of(texture)
	var entry: Dictionary = _parts[part.validate_node_name()]
	var place: Vector2 = st * float(entry["scale"]) + Vector2(entry["offset"][0], entry["offset"][1]) - Vector2(0.5, 0.5)
	var normal := (world_from_local.affine_inverse().basis * normal_world).normalized()
	var basis := Vector4(0.8862269, 1.0233267 * normal.y, 1.0233267 * normal.z, 1.0233267 * normal.x)
	var low := Vector2i(place.floor())
	var f := place - Vector2(low)
	var last := _slices[0].get_size() - Vector2i.ONE
	var first := low.clamp(Vector2i.ZERO, last)
	var second := (low + Vector2i.ONE).clamp(Vector2i.ZERO, last)
	var found := Color.BLACK
	for channel in 3:
		var above := _texel(channel, first).lerp(_texel(channel, Vector2i(second.x, first.y)), f.x)
		var below := _texel(channel, Vector2i(first.x, second.y)).lerp(_texel(channel, second), f.x)
		found[channel] = maxf(basis.dot(above.lerp(below, f.y)), 0.0)
	return found


## The four coefficients of a channel of a texel, under what shines.
func _texel(channel: int, at: Vector2i) -> Vector4:
	if relit == null:
		return scale * _vector(_slices[channel].get_pixelv(at))
	if _tables.is_empty():
		_tables = Volumes.slices_of(relit.tables[0])
	var total := Vector4.ZERO
	for row in range(0, rows.size(), relit.ENTRY):
		var first := 4 * int(rows[row])
		if rows[row + 1 + channel] != 0.0:
			total += rows[row + 1 + channel] * _vector(_tables[first + channel].get_pixelv(at))
		if rows[row + 4 + channel] != 0.0:
			total += rows[row + 4 + channel] * _vector(_tables[first + 3].get_pixelv(at))
	return total


static func _vector(colour: Color) -> Vector4:
	return Vector4(colour.r, colour.g, colour.b, colour.a)
