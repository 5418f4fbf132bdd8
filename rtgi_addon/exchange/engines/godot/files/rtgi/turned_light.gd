@tool
extends RefCounted
## LightmapGIData in another place. Godot 4.6 can shift a LightmapGI but not turn it: Basis::rotate_sh counts the signs of odd
## harmonics as with Condon and Shortley, and its shaders do not. So points, planes and harmonics are turned here.

## Gauss and Legendre's heights and weights, exact for products of two of the nine harmonics.
const HEIGHTS: Array[float] = [-0.7745966692414834, 0.0, 0.7745966692414834]
const WEIGHTS: Array[float] = [0.5555555555555556, 0.8888888888888889, 0.5555555555555556]
const STEPS := 5


## A copy of [param data] as it is seen from the world when it lies in [param world_from_local].
static func placed(data: LightmapGIData, world_from_local: Transform3D) -> LightmapGIData:
	var content: Dictionary = data.get("probe_data").duplicate()
	content["points"] = world_from_local * (content["points"] as PackedVector3Array)
	content["bounds"] = world_from_local * (content["bounds"] as AABB)
	content["bsp"] = _moved_planes(content["bsp"], world_from_local)
	content["sh"] = _turned_harmonics(content["sh"], world_from_local.basis.orthonormalized())
	var result := LightmapGIData.new()
	result.set("probe_data", content)
	return result


## A node of the tree: the bits of a plane's normal and distance as floats, and its two children.
static func _moved_planes(tree: PackedInt32Array, world_from_local: Transform3D) -> PackedInt32Array:
	var floats := tree.to_byte_array().to_float32_array()
	var normals := world_from_local.basis.inverse().transposed()
	for node in range(0, tree.size(), 6):
		var normal := normals * Vector3(floats[node], floats[node + 1], floats[node + 2])
		var distance := floats[node + 3] + normal.dot(world_from_local.origin)
		var length := normal.length()
		for axis in 3:
			floats[node + axis] = normal[axis] / length
		floats[node + 3] = distance / length
	var result := floats.to_byte_array().to_int32_array()
	for node in range(0, tree.size(), 6):
		result[node + 4] = tree[node + 4]
		result[node + 5] = tree[node + 5]
	return result


static func _turned_harmonics(colours: PackedColorArray, rotation: Basis) -> PackedColorArray:
	var matrix := _rotation_matrix(rotation)
	var result := PackedColorArray()
	result.resize(colours.size())
	for point in range(0, colours.size(), 9):
		for row in 9:
			var sum := Color(0.0, 0.0, 0.0, 0.0)
			for column in 9:
				sum += colours[point + column] * matrix[row * 9 + column]
			result[point + row] = sum
	return result


## The integrals of Y_i(d) Y_j(R^-1 d): what turns nine harmonics, row after row.
static func _rotation_matrix(rotation: Basis) -> PackedFloat64Array:
	var matrix := PackedFloat64Array()
	matrix.resize(81)
	for ring in HEIGHTS.size():
		var radius := sqrt(1.0 - HEIGHTS[ring] * HEIGHTS[ring])
		for step in STEPS:
			var angle := TAU * step / STEPS
			var direction := Vector3(radius * cos(angle), radius * sin(angle), HEIGHTS[ring])
			var here := _harmonics(direction)
			var there := _harmonics(rotation.transposed() * direction)
			for row in 9:
				for column in 9:
					matrix[row * 9 + column] += WEIGHTS[ring] * TAU / STEPS * here[row] * there[column]
	return matrix


static func _harmonics(n: Vector3) -> PackedFloat64Array:
	return [
		0.28209479, 0.48860251 * n.y, 0.48860251 * n.z, 0.48860251 * n.x, 1.09254843 * n.x * n.y, 1.09254843 * n.y * n.z,
		0.94617470 * n.z * n.z - 0.31539157, 1.09254843 * n.x * n.z, 0.54627422 * (n.x + n.y) * (n.x - n.y),
	]
