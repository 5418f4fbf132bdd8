extends "checks.gd"
## Holds this export's sphere probes to RTGI's own numbers: the look-up of spheres.gd on the imported maps, and
## irradiance.gdshaderinc on the GPU.

const BODY := """
	vec4 place = texelFetch(table, ivec2(column, 0), 0);
	vec4 value = rtgi_mirrored(place.xyz, texelFetch(table, ivec2(column, 1), 0).xyz, place.w);
	values[0] = value.rgb;
	values[1] = value.aaa;
"""


func _initialize() -> void:
	var expected := _expected("spheres.json")
	var opened := _opened("spheres.gd", "sphere probes") if expected else {}
	if opened.is_empty():
		return
	for place: Array in PLACES:
		# Moving rounds points once more; those few that this takes over an edge are not asked.
		var slack := 1.0 if place[1] == "" else 4.0
		for case: Dictionary in expected["cases"]:
			var spheres: RefCounted = opened[case["probes"]]
			spheres.world_from_local = place[0]
			_report(case["name"] + ", script" + place[1], _by_script(case, spheres), case["radiance"], case["tolerance"],
					"W/(sr m^2) and share", slack)
			if not _headless():
				_report(case["name"] + ", shader" + place[1], await _by_shader(case, spheres), case["radiance"], case["tolerance"],
						"W/(sr m^2) and share", slack)
	_finish("the shader")


func _by_script(case: Dictionary, spheres: RefCounted) -> Array:
	var found := []
	for row in case["points"].size():
		found.append(spheres.mirrored(spheres.world_from_local * _vector(case["points"][row]),
				spheres.world_from_local.basis * _vector(case["directions"][row]), case["roughness"][row]))
	return found


func _by_shader(case: Dictionary, spheres: RefCounted) -> Array:
	var columns := []
	for row in case["points"].size():
		columns.append([_colour(spheres.world_from_local * _vector(case["points"][row]), case["roughness"][row]),
				_colour(spheres.world_from_local.basis * _vector(case["directions"][row]))])
	var material := _material(_sources()[case["probes"]].path_join("irradiance.gdshaderinc"), 2, BODY)
	spheres.apply_to(material)
	var found := []
	for pair: Array in await _shown(material, _table(columns), 2):
		found.append([pair[0].x, pair[0].y, pair[0].z, pair[1].x])
	return found
