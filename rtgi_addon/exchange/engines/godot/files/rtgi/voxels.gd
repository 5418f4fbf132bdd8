@tool
extends RefCounted
## RTGI's lit voxels: their textures and the uniforms of voxels.gdshaderinc, with which shaders trace cones through the scene.

## Where the bake's own axes lie in the world: turned and moved, not scaled.
var world_from_local := Transform3D.IDENTITY
var _cells_from_local := Transform3D.IDENTITY
var _textures := {}  # name of a list -> Texture3D


## Reads [param folder]/voxels.json and the textures that it names. An error names what is missing.
func open(folder: String) -> Error:
	var path := folder.path_join("voxels.json")
	var index: Variant = JSON.parse_string(FileAccess.get_file_as_string(path))
	if index is not Dictionary:
		push_error("RTGI: %s is missing or damaged: export again" % path)
		return ERR_FILE_CANT_READ
	_textures.clear()
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
