extends "checks.gd"
## Irradiance from the light atlas, by the look-up of atlas.gd and by that of irradiance.gdshaderinc.

const BODY := "	values[0] = rtgi_atlas(texelFetch(table, ivec2(column, 0), 0).xy, texelFetch(table, ivec2(column, 1), 0).xyz);"


## At the places and under the normals of `asked`.
func _by_script(asked: Dictionary, atlas: RefCounted) -> Array:
	var found := []
	for row in asked["st"].size():
		found.append(atlas.irradiance(asked["parts"][row], Vector2(asked["st"][row][0], asked["st"][row][1]),
				atlas.world_from_local.basis * _vector(asked["normals"][row])))
	return found


## Those of a part at a time: a material knows one.
func _by_shader(asked: Dictionary, atlas: RefCounted, folder: String) -> Array:
	var rows := {}
	for row in asked["st"].size():
		rows.get_or_add(asked["parts"][row], []).append(row)
	var found := []
	found.resize(asked["st"].size())
	for part: String in rows:
		var columns := []
		for row: int in rows[part]:
			columns.append([Color(asked["st"][row][0], asked["st"][row][1], 0.0),
					_colour(atlas.world_from_local.basis * _vector(asked["normals"][row]))])
		var material := _material(folder.path_join("irradiance.gdshaderinc"), 1, BODY)
		atlas.apply_to(material, part.validate_node_name())
		var shown: Array = await _shown(material, _table(columns), 1)
		for column in shown.size():
			found[rows[part][column]] = shown[column][0]
	return found
