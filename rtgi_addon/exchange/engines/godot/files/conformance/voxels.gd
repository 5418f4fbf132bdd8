extends "checks.gd"
## Holds cones through this export's voxels to RTGI's own numbers: voxels.gd's look-up and voxels.gdshaderinc on the GPU, with the
## imported textures.

const BODY := "	values[0] = rtgi_voxels_irradiance(texelFetch(table, ivec2(column, 0), 0).xyz, texelFetch(table, ivec2(column, 1), 0).xyz);"

## Scripts take their time.
const SCRIPT_POINTS := 50


func _initialize() -> void:
	var expected := _expected("voxels.json")
	var opened := _opened("voxels.gd", "voxels") if expected else {}
	if opened.is_empty():
		return
	for place: Array in PLACES:
		for case: Dictionary in expected["cases"]:
			var voxels: RefCounted = opened[case["voxels"]]
			voxels.world_from_local = place[0]
			_report(case["name"] + ", script" + place[1], _by_script(case, voxels), case["irradiance"].slice(0, SCRIPT_POINTS),
					case["tolerance"].slice(0, SCRIPT_POINTS), "W/m^2")
			if not _headless():
				_report(case["name"] + ", shader" + place[1], await _by_shader(case, voxels), case["irradiance"], case["tolerance"],
						"W/m^2")
	_finish("the shader")


func _by_script(case: Dictionary, voxels: RefCounted) -> Array:
	var found := []
	for row in mini(SCRIPT_POINTS, case["points"].size()):
		var light: Vector3 = voxels.irradiance(voxels.world_from_local * _vector(case["points"][row]),
				voxels.world_from_local.basis * _vector(case["normals"][row]))
		found.append([light.x, light.y, light.z])
	return found


func _by_shader(case: Dictionary, voxels: RefCounted) -> Array:
	var columns := []
	for row in case["points"].size():
		columns.append([_colour(voxels.world_from_local * _vector(case["points"][row])),
				_colour(voxels.world_from_local.basis * _vector(case["normals"][row]))])
	var material := _material(_sources()[case["voxels"]].path_join("voxels.gdshaderinc"), 1, BODY)
	voxels.apply_to(material)
	return (await _shown(material, _table(columns), 1)).map(func(values: Array) -> Vector3: return values[0])
