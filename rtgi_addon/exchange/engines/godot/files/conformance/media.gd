extends "checks.gd"
## Holds this export's media to RTGI's own numbers: the march of media.gd on the imported textures, and media.gdshaderinc on the GPU.

const UNIFORMS := "uniform int steps = 1;
uniform bool rays = false;"
const BODY := """
	vec4 origin = texelFetch(table, ivec2(column, 0), 0);
	vec3 first;
	vec3 second;
	if (rays) {
		rtgi_media_march(origin.xyz, texelFetch(table, ivec2(column, 1), 0).xyz, origin.w, steps, 0.5, first, second);
	} else {
		rtgi_media_at(origin.xyz, texelFetch(table, ivec2(column, 1), 0).xyz, first, second);
	}
	values[0] = first;
	values[1] = second;
"""


func _initialize() -> void:
	var expected := _expected("media.json")
	var opened := _opened("media.gd", "media") if expected else {}
	if opened.is_empty():
		return
	for place: Array in PLACES:
		for case: Dictionary in expected["cases"]:
			var media: RefCounted = opened[case["media"]]
			media.world_from_local = place[0]
			var wanted := _pairs(case["first"], case["second"])
			var tolerance := _pairs(case["first_tolerance"], case["second_tolerance"])
			_report(case["name"] + ", script" + place[1], _by_script(case, media, int(expected["steps"])), wanted, tolerance, "of both")
			if not _headless():
				_report(case["name"] + ", shader" + place[1], await _by_shader(case, media, int(expected["steps"])), wanted, tolerance,
						"of both")
	_finish("the shader")


static func _pairs(first: Array, second: Array) -> Array:
	return range(first.size()).map(func(row: int) -> Array: return first[row] + second[row])


static func _numbers(pair: Array) -> Array:
	return [pair[0].x, pair[0].y, pair[0].z, pair[1].x, pair[1].y, pair[1].z]


func _by_script(case: Dictionary, media: RefCounted, steps: int) -> Array:
	var found := []
	for row in case["points"].size():
		var point: Vector3 = media.world_from_local * _vector(case["points"][row])
		var direction: Vector3 = media.world_from_local.basis * _vector(case["directions"][row])
		found.append(_numbers(media.march(point, direction, case["lengths"][row], steps) if case["kind"] == "rays"
				else media.at(point, direction)))
	return found


func _by_shader(case: Dictionary, media: RefCounted, steps: int) -> Array:
	var rays: bool = case["kind"] == "rays"
	var columns := []
	for row in case["points"].size():
		columns.append([_colour(media.world_from_local * _vector(case["points"][row]), case["lengths"][row] if rays else 0.0),
				_colour(media.world_from_local.basis * _vector(case["directions"][row]))])
	var material := _material(_sources()[case["media"]].path_join("media.gdshaderinc"), 2, BODY, UNIFORMS)
	material.set_shader_parameter("steps", steps)
	material.set_shader_parameter("rays", rays)
	media.apply_to(material)
	return (await _shown(material, _table(columns), 2)).map(_numbers)
