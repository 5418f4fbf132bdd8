@tool
extends RefCounted
## RTGI's lit voxels: their textures and the uniforms of voxels.gdshaderinc, with which shaders trace cones through the scene, and the
## same cones for scripts.

const Volumes := preload("volumes.gd")
const Cones := preload("voxel_cones.gd")

## Where the bake's own axes lie in the world: turned and moved, not scaled.
var world_from_local := Transform3D.IDENTITY
var _cells_from_local := Transform3D.IDENTITY
var _textures := {}  # name of a list -> Texture3D
## Of each nested grid, finest first: "low" and "high", its corners where the world is the bake's, "cell", the side of its cells, and
## "resolution" along Blender's axes.
var cascades: Array = []
var _lookup := {}
var _scales := {}  # name of a list -> what its numbers are over
var _cones: Cones


## Reads [param folder]/voxels.json and the textures that it names. An error names what is missing.
func open(folder: String) -> Error:
	var path := folder.path_join("voxels.json")
	var index: Variant = JSON.parse_string(FileAccess.get_file_as_string(path))
	if index is not Dictionary:
		push_error("RTGI: %s is missing or damaged: export again" % path)
		return ERR_FILE_CANT_READ
	_textures.clear()
	_cones = null
	cascades = index["cascades"]
	_lookup = index["lookup"]
	_scales = index["scales"]
	for name: String in index["lists"]:
		var texture := load(folder.path_join(index["lists"][name])) as Texture3D
		if texture == null:
			push_error("RTGI: %s is not imported as Texture3D" % folder.path_join(index["lists"][name]))
			return ERR_FILE_MISSING_DEPENDENCIES
		_textures[name] = texture
	var rows: Array = index["cells_from_local"]
	_cells_from_local = Transform3D(Vector3(rows[0][0], rows[1][0], rows[2][0]), Vector3(rows[0][1], rows[1][1], rows[2][1]),
			Vector3(rows[0][2], rows[1][2], rows[2][2]), Vector3(rows[0][3], rows[1][3], rows[2][3]))
	return OK


## Sets the uniforms of [param material], whose shader includes voxels.gdshaderinc.
func apply_to(material: ShaderMaterial) -> void:
	material.set_shader_parameter("rtgi_voxels_cells_from_world", Projection(_cells_from_local * world_from_local.affine_inverse()))
	for name: String in _textures:
		material.set_shader_parameter("rtgi_voxel_" + name, _textures[name])


## Irradiance [W/m^2] at a point of a surface under a unit normal; the first call reads the textures back. For a few points: a shader
## is thousands of times quicker.
func irradiance(point_world: Vector3, normal_world: Vector3) -> Vector3:
	var cells_from_world := _cells_from_local * world_from_local.affine_inverse()
	return _by_script().irradiance(cells_from_world * point_world, (cells_from_world.basis * normal_world).normalized())


## Radiance [W/(sr m^2)] that a surface of that roughness mirrors from a unit direction: one cone about half of its lobe.
func mirrored(point_world: Vector3, normal_world: Vector3, direction_world: Vector3, roughness: float) -> Vector3:
	var alpha := minf(roughness * roughness, 0.5)
	var cells_from_world := _cells_from_local * world_from_local.affine_inverse()
	return _by_script().seen(cells_from_world * point_world, (cells_from_world.basis * direction_world).normalized(),
			(cells_from_world.basis * normal_world).normalized(), 2.0 * alpha / (1.0 - alpha * alpha))


func _by_script() -> Cones:
	if _cones == null:
		_cones = Cones.new(_lookup, _numbers("rows", 1), _numbers("cells", 4), _numbers("light", 4))
	return _cones


# A list as numbers, one after the other.
func _numbers(name: String, channels: int) -> PackedFloat32Array:
	var bytes := PackedByteArray()
	for slice in Volumes.slices_of(_textures[name]):
		slice.convert(Image.FORMAT_RF if channels == 1 else Image.FORMAT_RGBAF)
		bytes.append_array(slice.get_data())
	var numbers := bytes.to_float32_array()
	var scale: float = _scales[name]
	if scale != 1.0:
		for index in numbers.size():
			numbers[index] *= scale
	return numbers
