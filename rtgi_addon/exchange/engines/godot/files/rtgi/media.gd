@tool
extends RefCounted
## RTGI's media: their textures, the uniforms of media.gdshaderinc, what Godot's own fog needs, and the same march for scripts.

# The numbers of media_functions.gdshaderinc.
const THIN := 0.01
const BAND_0 := 0.2820948
const BAND_1 := 0.4886025
const BAND_2 := 1.0925484
const BAND_2_ZONAL := 0.3153916
const BAND_2_LAST := 0.5462742
## What a fog volume adds to the density of the world, and how dense the world must be to glow.
const LEAST := 0.001953125
const GLOWING := 0.0001

const Volumes := preload("volumes.gd")

## Where the media's own axes lie in the world: turned and moved, not scaled.
var world_from_local := Transform3D.IDENTITY
var everywhere := false
var extinction: Vector3
var emission: Vector3
## Scattering times the moments of the phase function, of bands 0, 1 and 2.
var scattering: Array[Vector3] = []
## The one g that Godot's fog has.
var anisotropy := 0.0
var ambient: Cells
var boxes: Array[Box] = []


class Cells:
	var texture: Texture3D
	var scale: float  ## what the numbers of the texture are over
	var size: Vector3i
	var blocks: int
	var unit_from_local: Transform3D
	var slices: Array[Image] = []


class Box:
	extends Cells
	var name: String
	var scattering: Vector3
	var absorption: Vector3
	var emission: Vector3
	var moments: Vector2

	## What a shader multiplies by what it reads, or takes as it is where all cells give the same.
	func emission_of_cells() -> Vector3:
		return scale * emission if blocks > 1 else emission


## Reads [param folder]/media.json and the textures that it names. An error names what is missing.
func open(folder: String) -> Error:
	boxes.clear()
	var path := folder.path_join("media.json")
	var index: Variant = JSON.parse_string(FileAccess.get_file_as_string(path))
	if index is not Dictionary:
		push_error("RTGI: %s is missing or damaged: export again" % path)
		return ERR_FILE_CANT_READ
	everywhere = index["everywhere"]
	extinction = _vector(index["extinction"])
	emission = _vector(index["emission"])
	scattering.assign(index["scattering"].map(_vector))
	anisotropy = index["anisotropy"]
	ambient = Cells.new()
	if not _open_cells(ambient, index["ambient"], folder, 7):
		return ERR_FILE_MISSING_DEPENDENCIES
	for entry: Dictionary in index["boxes"]:
		var box := Box.new()
		box.name = entry["name"]
		box.scattering = _vector(entry["scattering"])
		box.absorption = _vector(entry["absorption"])
		box.emission = _vector(entry["emission"])
		box.moments = Vector2(entry["moments"][0], entry["moments"][1])
		if not _open_cells(box, entry, folder, entry["blocks"]):
			return ERR_FILE_MISSING_DEPENDENCIES
		boxes.append(box)
	return OK


## Sets the uniforms of [param material], whose shader includes media.gdshaderinc.
func apply_to(material: ShaderMaterial) -> void:
	var local_from_world := world_from_local.affine_inverse()
	material.set_shader_parameter("rtgi_media_ambient", ambient.texture)
	material.set_shader_parameter("rtgi_media_ambient_from_world", Projection(ambient.unit_from_local * local_from_world))
	material.set_shader_parameter("rtgi_media_ambient_size", Vector3(ambient.size))
	material.set_shader_parameter("rtgi_media_turn", local_from_world.basis)
	material.set_shader_parameter("rtgi_media_everywhere", everywhere)
	material.set_shader_parameter("rtgi_media_extinction", extinction)
	material.set_shader_parameter("rtgi_media_emission", emission)
	material.set_shader_parameter("rtgi_media_scattering", Basis(scattering[0], scattering[1], scattering[2]))
	for number in boxes.size():
		var box := boxes[number]
		material.set_shader_parameter("rtgi_cells_%d" % number, box.texture)
		material.set_shader_parameter("rtgi_unit_from_world_%d" % number, Projection(box.unit_from_local * local_from_world))
		material.set_shader_parameter("rtgi_cells_size_%d" % number, Vector4(box.size.x, box.size.y, box.size.z, box.blocks))
		material.set_shader_parameter("rtgi_scattering_%d" % number, box.scale * box.scattering)
		material.set_shader_parameter("rtgi_absorption_%d" % number, box.scale * box.absorption)
		material.set_shader_parameter("rtgi_emission_%d" % number, box.emission_of_cells())
		material.set_shader_parameter("rtgi_moments_%d" % number, box.moments)


## Gives [param environment] the world's medium as volumetric fog. The ambient light of the bake is added by a fog volume (fog.gd).
func apply_to_environment(environment: Environment) -> void:
	var density := (extinction.x + extinction.y + extinction.z) / 3.0
	# What the fog volume adds of density is not here as well.
	var own := density - LEAST if scatters_everywhere() and density > LEAST else density
	if emission != Vector3.ZERO:
		own = maxf(own, GLOWING)
	environment.volumetric_fog_enabled = true
	environment.volumetric_fog_density = own
	environment.volumetric_fog_albedo = _stored(scattering[0] / own if own > 0.0 else Vector3.ZERO)
	environment.volumetric_fog_emission = _stored(emission / own if own > 0.0 else Vector3.ZERO)
	environment.volumetric_fog_emission_energy = 1.0
	environment.volumetric_fog_anisotropy = anisotropy
	environment.volumetric_fog_length = clampf(2.0 * ambient.unit_from_local.affine_inverse().basis.get_scale().length(), 16.0, 1024.0)
	environment.volumetric_fog_ambient_inject = 0.0
	environment.volumetric_fog_gi_inject = 0.0


## Whether the ambient light needs a fog volume of its own.
func scatters_everywhere() -> bool:
	return scattering[0] != Vector3.ZERO


## A fog volume for [param box], or for the world where it is null, with [param shader], which is fog_volume.gdshader.
func fog_volume(box: Box, shader: Shader) -> FogVolume:
	var local_from_world := world_from_local.affine_inverse()
	var material := ShaderMaterial.new()
	material.shader = shader
	material.set_shader_parameter("fog_everywhere", box == null)
	material.set_shader_parameter("fog_bands", Basis(scattering[0], scattering[1], scattering[2]))
	material.set_shader_parameter("fog_ambient", ambient.texture)
	material.set_shader_parameter("fog_ambient_from_world", Projection(ambient.unit_from_local * local_from_world))
	material.set_shader_parameter("fog_ambient_size", Vector3(ambient.size))
	material.set_shader_parameter("fog_turn", local_from_world.basis)
	var volume := FogVolume.new()
	volume.material = material
	if box == null:
		volume.name = "World"
		volume.shape = RenderingServer.FOG_VOLUME_SHAPE_WORLD
		return volume
	material.set_shader_parameter("fog_cells", box.texture)
	material.set_shader_parameter("fog_unit_from_world", Projection(box.unit_from_local * local_from_world))
	material.set_shader_parameter("fog_cells_size", Vector4(box.size.x, box.size.y, box.size.z, box.blocks))
	material.set_shader_parameter("fog_scattering", box.scale * box.scattering)
	material.set_shader_parameter("fog_absorption", box.scale * box.absorption)
	material.set_shader_parameter("fog_emission", box.emission_of_cells())
	material.set_shader_parameter("fog_moments", box.moments)
	volume.name = box.name.validate_node_name()
	volume.shape = RenderingServer.FOG_VOLUME_SHAPE_BOX
	volume.size = Vector3.ONE
	volume.transform = box.unit_from_local.affine_inverse() * Transform3D(Basis.IDENTITY, Vector3(0.5, 0.5, 0.5))
	return volume


## Extinction [1/m] at a point, and the radiance a metre that media give and scatter there towards who looks along
## [param direction_world]; the first call reads the textures back.
func at(point_world: Vector3, direction_world: Vector3) -> Array[Vector3]:
	var local_from_world := world_from_local.affine_inverse()
	var point := local_from_world * point_world
	var taken := extinction
	var given := emission
	var scattered: Array[Vector3] = scattering.duplicate()
	for box in boxes:
		var unit := box.unit_from_local * point
		if unit.clamp(Vector3.ZERO, Vector3.ONE) != unit:
			continue
		var first := _sample(box, unit, 0)
		var own: Vector3 = box.scattering * first
		var absorbed := first
		var glow := Vector3.ONE
		if box.blocks > 1:
			absorbed = _sample(box, unit, 1)
			glow = _sample(box, unit, 2)
		taken += own + box.absorption * absorbed
		given += box.emission * glow
		scattered[0] += own
		scattered[1] += box.moments.x * own
		scattered[2] += box.moments.y * own
	var light := _bands(ambient.unit_from_local * point, local_from_world.basis * direction_world)
	var ambient_light: Vector3 = scattered[0] * light[0] + scattered[1] * light[1] + scattered[2] * light[2]
	return [taken, given + ambient_light.max(Vector3.ZERO)]


## Transmittance, and the radiance that media add, along a ray of some length with a unit direction, in so many steps.
func march(origin: Vector3, direction: Vector3, length: float, steps := 48, jitter := 0.5) -> Array[Vector3]:
	var first := 0.0
	var last := length
	if not everywhere:
		first = length
		last = 0.0
		var local_from_world := world_from_local.affine_inverse()
		for box in boxes:
			var span := _span(box.unit_from_local * local_from_world, origin, direction, length)
			if span.y > span.x:
				first = minf(first, span.x)
				last = maxf(last, span.y)
	var stride := maxf(last - first, 0.0) / steps
	var left := Vector3.ONE
	var gained := Vector3.ZERO
	if stride <= 0.0:
		return [left, gained]
	for number in steps:
		var found := at(origin + direction * (first + stride * (number + jitter)), direction)
		var depth := found[0] * stride
		for axis in 3:
			var passed := exp(-depth[axis])
			var share := 1.0 - depth[axis] * (0.5 - depth[axis] / 6.0) if depth[axis] < THIN else (1.0 - passed) / depth[axis]
			gained[axis] += left[axis] * found[1][axis] * share * stride
			left[axis] *= passed
	return [left, gained]


static func _span(unit_from_world: Transform3D, origin: Vector3, direction: Vector3, length: float) -> Vector2:
	var start := unit_from_world * origin
	var along := unit_from_world.basis * direction
	var enter := 0.0
	var leave := length
	for axis in 3:
		var way := along[axis] if absf(along[axis]) > 1e-12 else 1e-12
		var low := -start[axis] / way
		var high := (1.0 - start[axis]) / way
		enter = maxf(enter, minf(low, high))
		leave = minf(leave, maxf(low, high))
	return Vector2(enter, leave)


func _bands(unit: Vector3, d: Vector3) -> Array[Vector3]:
	var texels: Array[Color] = []
	for block in 7:
		texels.append(_texel(ambient, unit, block))
	var result: Array[Vector3] = [Vector3.ZERO, Vector3.ZERO, Vector3.ZERO]
	for channel in 3:
		var low := texels[2 * channel]
		var high := texels[2 * channel + 1]
		result[0][channel] = BAND_0 * low.r
		result[1][channel] = BAND_1 * (d.y * low.g + d.z * low.b + d.x * low.a)
		result[2][channel] = (BAND_2 * (d.x * d.y * high.r + d.y * d.z * high.g + d.x * d.z * high.a)
				+ BAND_2_ZONAL * (3.0 * d.z * d.z - 1.0) * high.b + BAND_2_LAST * (d.x * d.x - d.y * d.y) * texels[6][channel])
	return result


func _sample(cells: Cells, unit: Vector3, block: int) -> Vector3:
	var colour := _texel(cells, unit, block)
	return Vector3(colour.r, colour.g, colour.b) if cells.blocks > 1 else Vector3(colour.r, colour.r, colour.r)


static func _texel(cells: Cells, unit: Vector3, block: int) -> Color:
	if cells.slices.is_empty():
		cells.slices = Volumes.slices_of(cells.texture)
	var last := cells.size - Vector3i.ONE
	var place := (unit * Vector3(cells.size) - Vector3(0.5, 0.5, 0.5)).clamp(Vector3.ZERO, Vector3(last))
	var low := Vector3i(place).min((last - Vector3i.ONE).max(Vector3i.ZERO))
	var f := place - Vector3(low)
	var high := (low + Vector3i.ONE).min(last)
	var layers: Array[Color] = []
	for z: int in [low.z, high.z]:
		var slice := cells.slices[block * cells.size.z + z]
		var below := slice.get_pixel(low.x, low.y).lerp(slice.get_pixel(high.x, low.y), f.x)
		var above := slice.get_pixel(low.x, high.y).lerp(slice.get_pixel(high.x, high.y), f.x)
		layers.append(below.lerp(above, f.y))
	return layers[0].lerp(layers[1], f.z) * cells.scale


func _open_cells(cells: Cells, entry: Dictionary, folder: String, blocks: int) -> bool:
	var rows: Array = entry["unit_from_local"]
	var columns := range(4).map(func(column: int) -> Vector3: return Vector3(rows[0][column], rows[1][column], rows[2][column]))
	cells.unit_from_local = Transform3D(columns[0], columns[1], columns[2], columns[3])
	cells.size = Vector3i(entry["resolution"][0], entry["resolution"][1], entry["resolution"][2])
	cells.blocks = blocks
	cells.scale = entry["scale"]
	cells.texture = load(folder.path_join(entry["cells"])) as Texture3D
	if cells.texture == null:
		push_error("RTGI: %s is not imported as Texture3D" % folder.path_join(entry["cells"]))
	return cells.texture != null


## Environments keep colours as a screen shows them.
static func _stored(linear: Vector3) -> Color:
	return Color(linear.x, linear.y, linear.z).linear_to_srgb()


static func _vector(row: Array) -> Vector3:
	return Vector3(row[0], row[1], row[2])
