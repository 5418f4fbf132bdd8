extends "atlas_checks.gd"
## Holds this export's light atlas to RTGI's own numbers: the look-up of atlas.gd on the imported texture, and
## irradiance.gdshaderinc on the GPU.


func _initialize() -> void:
	var expected := _expected("atlas.json")
	var opened := _opened("atlas.gd", "light atlas") if expected else {}
	if opened.is_empty():
		return
	for place: Array in PLACES:
		for case: Dictionary in expected["cases"]:
			var atlas: RefCounted = opened[case["atlas"]]
			# Of the place the axes alone count.
			atlas.world_from_local = place[0]
			_report(case["name"] + ", script" + place[1], _by_script(case, atlas), case["irradiance"], case["tolerance"], "W/m^2")
			if not _headless():
				_report(case["name"] + ", shader" + place[1], await _by_shader(case, atlas, _sources()[case["atlas"]]),
						case["irradiance"], case["tolerance"], "W/m^2")
	_finish("the shader")
