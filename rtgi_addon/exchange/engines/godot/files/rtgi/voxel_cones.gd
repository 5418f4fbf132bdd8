extends RefCounted
## Cones through lit voxels for scripts: what voxels.gdshaderinc does on the GPU. Lengths are in cells of the grid that one is in.

const FAR := 1e30

## Of voxels.json: what the shader has as constants.
var _numbers: Dictionary
var _levels: Array[Vector4i] = []
var _origins: Array[Vector3] = []
var _cones: Array[Vector4] = []
var _sky: Array[Vector3] = []
var _grids: int
var _spread: float
var _step: float
var _near: float
# The lists, one number after the other.
var _rows: PackedFloat32Array
var _cells: PackedFloat32Array
var _light: PackedFloat32Array


class Ray:
	var grid: int
	var start: Vector3
	var direction: Vector3
	var normal: Vector3  ## zero for one that leaves no surface


class Seen:
	var radiance := Vector3.ZERO
	var passed := 1.0
	var at := 0.0


class Found:
	var depth := 0.0
	var glow := Vector3.ZERO
	var share := 0.0
	var shown := Vector3.ZERO


func _init(lookup: Dictionary, rows: PackedFloat32Array, cells: PackedFloat32Array, light: PackedFloat32Array) -> void:
	_numbers = lookup["numbers"]
	for row: Array in lookup["levels"]:
		_levels.append(Vector4i(row[0], row[1], row[2], row[3]))
	for row: Array in lookup["origins"]:
		_origins.append(Vector3(row[0], row[1], row[2]))
	for row: Array in lookup["cones"]:
		_cones.append(Vector4(row[0], row[1], row[2], row[3]))
	for row: Array in lookup["sky"]:
		_sky.append(Vector3(row[0], row[1], row[2]))
	_grids = lookup["grids"]
	_spread = lookup["spread"]
	_step = lookup["step"]
	_near = lookup["near"]
	_rows = rows
	_cells = cells
	_light = light


## Irradiance at a place in the finest cells under a unit normal of the voxels' own axes.
func irradiance(start: Vector3, normal: Vector3) -> Vector3:
	var sum := Vector3.ZERO
	for cone in _cones:
		sum += PI * cone.w * seen(start, _about(normal, Vector3(cone.x, cone.y, cone.z)), normal, _spread)
	return sum


## What one cone sees, sky and all; the normal is zero where it leaves no surface.
func seen(start: Vector3, direction: Vector3, normal: Vector3, spread: float) -> Vector3:
	var sum := Vector3.ZERO
	var left := 1.0
	for grid in _grids:
		var ray := Ray.new()
		ray.grid = grid
		ray.start = _place(0, grid, start)
		ray.direction = direction
		ray.normal = normal
		var share := left if grid == _grids - 1 else left * (1.0 - _outside(grid, ray.start))
		left -= share
		if share > 0.0:
			var found := _cone(ray, spread)
			sum += share * (found.radiance + (found.passed * _sky_towards(direction) if found.passed > 0.0 else Vector3.ZERO))
		if left <= 0.0:
			break
	return sum


static func _about(normal: Vector3, local: Vector3) -> Vector3:
	var turn := -1.0 if normal.z < 0.0 else 1.0
	var a := -1.0 / (turn + normal.z)
	var b := normal.x * normal.y * a
	var tangent := Vector3(1.0 + turn * normal.x * normal.x * a, turn * b, -turn * normal.x)
	return tangent * local.x + Vector3(b, turn + normal.y * normal.y * a, -normal.y) * local.y + normal * local.z


func _sky_towards(d: Vector3) -> Vector3:
	var sum := _sky[0] * 0.28209479 + _sky[1] * (0.48860251 * d.y) + _sky[2] * (0.48860251 * d.z)
	sum += _sky[3] * (0.48860251 * d.x) + _sky[4] * (1.09254843 * d.x * d.y)
	sum += _sky[5] * (1.09254843 * d.y * d.z) + _sky[6] * (0.31539157 * (3.0 * d.z * d.z - 1.0))
	sum += _sky[7] * (1.09254843 * d.x * d.z) + _sky[8] * (0.54627422 * (d.x * d.x - d.y * d.y))
	return sum.max(Vector3.ZERO)


func _cone(ray: Ray, spread: float) -> Seen:
	var clear := FAR
	var reach := _near
	if ray.normal != Vector3.ZERO:
		var own := ray.normal.abs()
		clear = ray.direction.dot(ray.normal) / (float(_numbers["CONE_SUPPORT"]) * (own.x + own.y + own.z))
		reach = maxf(reach, 1.0 / maxf(clear, 1e-6))
	var result := _march(ray, reach)
	var last := _grids - 1
	var span := _span(last, _place(ray.grid, last, ray.start), ray.direction) * float(1 << (last - ray.grid))
	var leave := span.y + minf(maxf(spread * span.y, 1.0), clear * maxf(span.y, 0.0) + 1.0)
	var top := _levels.size() - 1 - ray.grid
	var spent: float = _numbers["VOXEL_SPENT"]
	var tight: float = _numbers["CONE_TIGHT"]
	var at := maxf(span.x, result.at)
	var sheet := 1.0
	var level := 0.0
	while at < leave - 1e-5 and result.passed > spent:
		var lod := minf(minf(_log2(maxf(spread * at, 1.0)), floorf(_log2(maxf(clear * at, 1.0)))), float(top))
		level = maxf(_narrow(ray, at, level if sheet < 1.0 else lod), _least(ray.grid, ray.start + ray.direction * at))
		var way := minf(_step * pow(2.0, level), leave - at)
		var middle := ray.start + ray.direction * (at + 0.5 * way)
		var lower := mini(int(level), top)
		var blend := level - float(lower)
		var met := Found.new()
		_add(ray.grid, ray.grid + lower, middle, ray.direction, 1.0 - blend, met)
		if blend > 0.0 and lower < top:
			_add(ray.grid, ray.grid + lower + 1, middle, ray.direction, blend, met)
		# Shares of one sheet add up, all else multiplies.
		var crossed := tight * met.share * way
		var cut := minf(crossed / maxf(sheet, 1e-6), 1.0)
		sheet = sheet - crossed if crossed > 0.0 else 1.0
		var rest := _taken(met.depth * way)
		if met.share > 0.0:
			result.radiance += result.passed * cut * (1.0 - 0.5 * rest) / met.share * met.shown
		if met.depth > 0.0:
			result.radiance += result.passed * rest * (1.0 - 0.5 * cut) / met.depth * met.glow
		result.passed *= (1.0 - rest) * (1.0 - cut)
		at += way
	if result.passed <= spent:
		result.passed = 0.0
	return result


static func _log2(value: float) -> float:
	return log(value) / log(2.0)


static func _taken(depth: float) -> float:
	return depth * (1.0 - 0.5 * depth) if depth < 1e-3 else 1.0 - exp(-depth)


# `lod`, or the largest whole number below it for which no level that the next sample lies between has cells that are too wide.
func _narrow(ray: Ray, at: float, lod: float) -> float:
	for over in range(mini(ceili(lod), _levels.size() - 1 - ray.grid), 0, -1):
		if lod > float(over - 1):
			var middle := ray.start + ray.direction * (at + 0.5 * _step * pow(2.0, lod))
			var level := ray.grid + over
			if fmod(2.0 * _number(level, _low(level, _sample_place(ray.grid, level, middle))), 1.0) > 0.25:
				lod = float(over - 1)
	return lod


# The least level that may answer at a place: where it is beyond a grid, the next one, and between two where both do.
func _least(grid: int, position: Vector3) -> float:
	var least := 0.0
	for over in _grids - 1 - grid:
		if least == float(over):
			least += _outside(grid + over, _place(grid, grid + over, position))
	return least


func _sample_place(grid: int, level: int, position: Vector3) -> Vector3:
	var shape := _levels[level]
	return (_place(grid, level, position) + Vector3(0.5, 0.5, 0.5)).clamp(Vector3.ZERO, Vector3(shape.x - 1, shape.y - 1, shape.z - 1))


func _low(level: int, place: Vector3) -> Vector3i:
	var shape := _levels[level]
	return Vector3i(place).min(Vector3i(shape.x - 2, shape.y - 2, shape.z - 2))


func _add(grid: int, level: int, position: Vector3, direction: Vector3, weight: float, met: Found) -> void:
	var place := _sample_place(grid, level, position)
	var low := _low(level, place)
	if _number(level, low) == 0.0:
		return
	var part := place - Vector3(low)
	var scale := weight / float(1 << (level - grid))
	for corner in 8:
		var up := Vector3i(corner & 1, corner >> 1 & 1, corner >> 2)
		var share := ((part.x if up.x else 1.0 - part.x) * (part.y if up.y else 1.0 - part.y) * (part.z if up.z else 1.0 - part.z)
				* scale)
		var row := int(_number(level, low + up)) if share > 0.0 else 0
		if row == 0:
			continue
		var cell := 12 * row
		var way := direction * share
		var crossed := way.abs()
		var adds := _cells[cell + 3] != 0.0
		if adds and level < _grids:
			# A grid's own cells add for those who are in a finer one, and add what they block.
			adds = level > grid
			if adds:
				for axis in 3:
					var own := _cells[cell + axis]
					crossed[axis] *= _taken(own) / own if own > 0.0 else 1.0
		var depth := _vector(_cells, cell).dot(crossed)
		if adds:
			met.share += depth
			met.shown += _glow(row, direction, crossed)
			continue
		if depth > 0.0:
			met.depth += depth
			met.glow += _glow(row, direction, crossed)
		var through := _vector(_cells, cell + 4).dot(way)
		if through != 0.0:
			met.share += absf(through)
			met.shown += absf(through) * _shown(row, through)


# Cell by cell until the ray leaves its grid, or comes to an empty cell after `reach`.
func _march(ray: Ray, reach: float) -> Seen:
	var result := Seen.new()
	var span := _span(ray.grid, ray.start, ray.direction)
	result.at = span.x
	if span.y <= span.x:
		return result
	var shape := _levels[ray.grid]
	var last := Vector3i(shape.x - 3, shape.y - 3, shape.z - 3)
	var entry := ray.start + ray.direction * span.x
	var cell := Vector3i(entry.floor()).clamp(Vector3i.ZERO, last)
	var step := Vector3i.ONE
	for axis in 3:
		if ray.direction[axis] < 0.0:
			step[axis] = -1
			# A ray that starts between two cells is in the one that it goes to.
			if entry[axis] == float(cell[axis]) and cell[axis] > 0:
				cell[axis] -= 1
	var spent: float = _numbers["VOXEL_SPENT"]
	var row := int(_number(ray.grid, cell + Vector3i.ONE))
	for count in last.x + last.y + last.z + 3:
		var ahead := Vector3(FAR, FAR, FAR)
		for axis in 3:
			if ray.direction[axis] != 0.0:
				ahead[axis] = (float(cell[axis] + maxi(step[axis], 0)) - ray.start[axis]) / ray.direction[axis]
		var axis := 0 if ahead.x <= ahead.y and ahead.x <= ahead.z else (1 if ahead.y <= ahead.z else 2)
		var end := minf(ahead[axis], span.y)
		if row > 0:
			_meet(ray, row, ray.start - Vector3(cell) - Vector3(0.5, 0.5, 0.5), end, result)
		result.at = end
		cell[axis] += step[axis]
		row = int(_number(ray.grid, cell + Vector3i.ONE))
		if end >= span.y or result.passed <= spent or (end >= reach and row == 0):
			break
	if result.passed <= spent:
		result.passed = 0.0
	return result


# What a voxel takes and shows on the part of a ray up to `end`; `from` is where the ray starts from its centre.
func _meet(ray: Ray, row: int, from: Vector3, end: float, result: Seen) -> void:
	var cell := 12 * row
	var plane := _vector(_cells, cell + 8)
	var filled := _cells[cell + 7]
	var way := ray.direction * maxf(end - result.at, 0.0)
	var crossed := way.abs()
	var begin := from + ray.direction * result.at
	var before := plane.dot(begin) - _cells[cell + 11]
	var through := plane.dot(way)
	var gap: float = _numbers["VOXEL_GAP"]
	var cut := maxf(filled, 0.0) if minf(before, before + through) < gap and maxf(before, before + through) > -gap else 0.0
	if filled < 0.0:
		# What lies across an axis is met where it lies, and not on the way there.
		var near: float = _numbers["VOXEL_PLATE"]
		for axis in 3:
			if plane[axis] < float(_numbers["VOXEL_NO_PLATE"]):
				var first := begin[axis] - plane[axis]
				var second := first + way[axis]
				crossed[axis] = 1.0 if minf(first, second) < near and maxf(first, second) > -near else 0.0
	if ray.normal != Vector3.ZERO:
		var own := ray.normal.abs()
		if absf(from.dot(ray.normal)) <= 0.5 * (own.x + own.y + own.z) + float(_numbers["VOXEL_TOUCHING"]):
			for axis in 3:
				if own[axis] > float(_numbers["VOXEL_OWN_AXIS"]):
					crossed[axis] = 0.0
			if absf(plane.dot(ray.normal)) > float(_numbers["VOXEL_OWN_PLANE"]):
				cut = 0.0
	var depth := _vector(_cells, cell).dot(crossed)
	var blocked := _taken(depth)
	if depth > 0.0:
		result.radiance += result.passed * blocked / depth * _glow(row, ray.direction, crossed)
	if cut > 0.0:
		result.radiance += result.passed * cut * _shown(row, through)
	result.passed *= 1.0 - blocked - cut


func _glow(row: int, direction: Vector3, crossed: Vector3) -> Vector3:
	var sum := Vector3.ZERO
	for axis in 3:
		if crossed[axis] > 0.0:
			sum += crossed[axis] * _vector(_light, 4 * (8 * row + 2 * axis + (1 if direction[axis] < 0.0 else 0)))
	return sum


func _shown(row: int, through: float) -> Vector3:
	return _vector(_light, 4 * (8 * row + (7 if through > 0.0 else 6)))


static func _vector(list: PackedFloat32Array, first: int) -> Vector3:
	return Vector3(list[first], list[first + 1], list[first + 2])


# The row in the lists of a cell, whose array begins with an empty layer, and the half and the quarter beside it (see the shader).
func _number(level: int, cell: Vector3i) -> float:
	var shape := _levels[level]
	if cell.x < 0 or cell.y < 0 or cell.z < 0 or cell.x >= shape.x or cell.y >= shape.y or cell.z >= shape.z:
		return 0.0
	return _rows[shape.w + (cell.z * shape.y + cell.y) * shape.x + cell.x]


# Where a place in the cells of a grid lies in those of a level that is no finer.
func _place(grid: int, level: int, place: Vector3) -> Vector3:
	return place / float(1 << (level - grid)) - (_origins[level] - _origins[grid]) / float(1 << level)


# How far a place in the cells of a grid is on the way out of it: 0 within, 1 where the next one answers alone.
func _outside(grid: int, place: Vector3) -> float:
	var shape := _levels[grid]
	var inward := place.min(Vector3(shape.x - 2, shape.y - 2, shape.z - 2) - place)
	var blend: float = _numbers["VOXEL_BLEND"]
	return clampf((float(_numbers["VOXEL_EDGE"]) + blend - minf(minf(inward.x, inward.y), inward.z)) / blend, 0.0, 1.0)


# Where a ray enters and leaves a grid; it begins at 0.
func _span(grid: int, start: Vector3, direction: Vector3) -> Vector2:
	var shape := _levels[grid]
	var high := Vector3(shape.x - 2, shape.y - 2, shape.z - 2)
	var span := Vector2(0.0, FAR)
	for axis in 3:
		if direction[axis] == 0.0:
			# Between the planes all the way, or nowhere.
			if start[axis] < 0.0 or start[axis] >= high[axis]:
				span = Vector2(FAR, -FAR)
			continue
		var first := -start[axis] / direction[axis]
		var second := (high[axis] - start[axis]) / direction[axis]
		span = Vector2(maxf(span.x, minf(first, second)), minf(span.y, maxf(first, second)))
	return span
