@tool
extends RefCounted
## RTGI's transfer for scripts: what shines, as the columns of its tables, and the arithmetic of relight.gdshader.

const Volumes := preload("volumes.gd")
const NUMBERS := 28
const TEXELS := 7
## How much closer the directions of suns are near the horizon.
const POWER := 1.5
## Numbers of an entry of what shines: column, r, g, b; what is seen of it as a sun r, g, b, -; its direction x, y, z, -.
const ENTRY := 12

## The lights of the bake: name, and kind, which is "world", "suns" or "group".
var lights: Array = []
var sky_count := 0
var sun_side := 0
var sun_below := false
var scales: PackedFloat32Array
## Directions of the table's suns, in the axes of the probes.
var suns: PackedVector3Array
## Of each volume, in the order of volumes.gd: the table, and how many columns lie below each other in it.
var tables: Array[Texture3D] = []
var down: PackedInt32Array
var _slices: Array = []


## Reads [param name] in [param folder] and the tables that it names. An error names what is missing.
func open(folder: String, name := "transfer.json") -> Error:
	var index := Volumes.index_of(folder, name, "export a bundle that was baked with the technique transfer")
	if index.is_empty():
		return ERR_FILE_CANT_READ
	lights = index["lights"]
	sky_count = index["sky"]
	sun_side = index["sunSide"]
	sun_below = index["sunBelow"]
	scales = PackedFloat32Array(index["scales"])
	suns = _nodes(sun_side, sun_below)
	tables.clear()
	down.clear()
	for entry: Dictionary in index["volumes"]:
		var table := Volumes.texture_of(folder, entry["table"])
		if table == null:
			return ERR_FILE_MISSING_DEPENDENCIES
		tables.append(table)
		down.append(entry["down"])
		_slices.append([])
	return OK


## What shines as rows of ENTRY numbers. [param factors] are colours (Vector3) by the names of lights; [param new_suns] null for those
## of the file, else an array of {"towards", "irradiance"} in the probes' axes; [param sky] null for the baked world, else
## {"harmonics", "suns"}, arrays of [r, g, b].
func entries(factors: Dictionary, new_suns: Variant, sky: Variant) -> PackedFloat32Array:
	var light := PackedVector3Array()
	light.resize(scales.size())
	var first_sky := lights.size()
	var first_sun := first_sky + sky_count
	for column in lights.size():
		var kind: String = lights[column]["kind"]
		if not (kind == "world" and sky != null or kind == "suns" and new_suns != null):
			light[column] = factors.get(lights[column]["name"], Vector3.ONE)
	if sky != null:
		if sky["harmonics"].size() != sky_count or sky["suns"].size() != suns.size():
			push_error("RTGI: the sky has other harmonics or suns than the bake, which has %d and %d" % [sky_count, suns.size()])
			return PackedFloat32Array()
		for number in sky_count:
			light[first_sky + number] = _vector(sky["harmonics"][number])
		for number in suns.size():
			light[first_sun + number] = _vector(sky["suns"][number])
	if new_suns != null:
		for sun: Dictionary in new_suns:
			var nodes: Array = shares(sun["towards"])
			for node: Array in nodes:
				light[first_sun + node[0]] += node[1] * sun["irradiance"]
	var rows := PackedFloat32Array()
	for column in light.size():
		var seen := Vector3.ZERO
		var towards := Vector3.UP
		if sky != null and column >= first_sun:
			seen = _vector(sky["suns"][column - first_sun]) * scales[column]
			towards = suns[column - first_sun]
		if light[column] != Vector3.ZERO or seen != Vector3.ZERO:
			var scaled := light[column] * scales[column]
			rows.append_array([column, scaled.x, scaled.y, scaled.z, seen.x, seen.y, seen.z, 0.0, towards.x, towards.y, towards.z, 0.0])
	return rows


## [param sky] of the tables [param other] for these, which know other suns.
func sky_of(sky: Variant, other: RefCounted) -> Variant:
	if sky == null:
		return null
	var shared := []
	for number in suns.size():
		shared.append([0.0, 0.0, 0.0])
	for number in other.suns.size():
		for node: Array in shares(other.suns[number]):
			for channel in 3:
				shared[node[0]][channel] += node[1] * sky["suns"][number][channel]
	return {"harmonics": sky["harmonics"], "suns": shared}


## The nodes about a direction, [index, share] each.
func shares(towards: Vector3) -> Array:
	if sun_side < 2 or (towards.y < 0.0 and not sun_below):
		return []
	var sum := absf(towards.x) + absf(towards.y) + absf(towards.z)
	var away := maxf(absf(towards.x) + absf(towards.z), 1e-30)
	var flat := Vector2(towards.x, -towards.z) * ((1.0 - pow(absf(towards.y) / sum, 1.0 / POWER)) / away)
	var at := (Vector2(flat.x + flat.y, flat.x - flat.y).clampf(-1.0, 1.0) + Vector2.ONE) * (0.5 * (sun_side - 1))
	var column := mini(int(at.x), sun_side - 2)
	var row := mini(int(at.y), sun_side - 2)
	var f := at - Vector2(column, row)
	var node := row * sun_side + column + (sun_side * sun_side if towards.y < 0.0 else 0)
	return [[node, (1.0 - f.x) * (1.0 - f.y)], [node + 1, f.x * (1.0 - f.y)], [node + sun_side, (1.0 - f.x) * f.y],
			[node + sun_side + 1, f.x * f.y]]


## Directions of the dome's nodes (numerics/dome.py of RTGI, whose axes are Blender's), y up.
static func _nodes(side: int, below: bool) -> PackedVector3Array:
	var result := PackedVector3Array()
	for row in side:
		for column in side:
			var u := 2.0 * column / (side - 1) - 1.0
			var v := 2.0 * row / (side - 1) - 1.0
			var away := 0.5 * (absf(u + v) + absf(u - v))
			var z := pow(maxf(1.0 - away, 0.0), POWER)
			var scale := 0.5 * (1.0 - z) / maxf(away, 1e-30)
			result.append(Vector3(scale * (u + v), z, -scale * (u - v)).normalized())
	if below:
		for node in side * side:
			result.append(result[node] * Vector3(1.0, -1.0, 1.0))
	return result


## The harmonics of all probes of volume [param number], of [param size], under the [param rows] of `entries`: nine a probe, as
## volumes.gd keeps them. May run on any thread.
func harmonics(number: int, size: Vector3i, rows: PackedFloat32Array) -> PackedVector3Array:
	var count := size.x * size.y * size.z
	var sums := PackedFloat64Array()
	sums.resize(27 * count)
	for row in range(0, rows.size(), ENTRY):
		var table := _column(number, size, int(rows[row]))
		var light := [rows[row + 1], rows[row + 2], rows[row + 3]]
		var seen := Vector3(rows[row + 4], rows[row + 5], rows[row + 6])
		var basis := _harmonics(Vector3(rows[row + 8], rows[row + 9], rows[row + 10]))
		for probe in count:
			var from := NUMBERS * probe
			var to := 27 * probe
			for value in 27:
				sums[to + value] += light[value % 3] * table[from + value]
			if seen != Vector3.ZERO:
				for band in 9:
					var shown := table[from + 27] * basis[band]
					for channel in 3:
						sums[to + 3 * band + channel] += shown * seen[channel]
	var result := PackedVector3Array()
	result.resize(9 * count)
	for probe in count:
		dering(sums, 27 * probe)
		for band in 9:
			var at := 27 * probe + 3 * band
			result[9 * probe + band] = Vector3(sums[at], sums[at + 1], sums[at + 2])
	return result


## A column of a table: NUMBERS floats for each probe.
func _column(number: int, size: Vector3i, column: int) -> PackedFloat32Array:
	if _slices[number].is_empty():
		_slices[number] = Volumes.slices_of(tables[number])
	var result := PackedFloat32Array()
	var region := Rect2i(0, column % down[number] * size.y, size.x * TEXELS, size.y)
	for z in size.z:
		var slice: Image = _slices[number][column / down[number] * size.z + z].get_region(region)
		slice.convert(Image.FORMAT_RGBAF)
		result.append_array(slice.get_data().to_float32_array())
	return result


static func _harmonics(n: Vector3) -> PackedFloat64Array:
	return [
		0.28209479, 0.48860251 * n.y, 0.48860251 * n.z, 0.48860251 * n.x, 1.09254843 * n.x * n.y, 1.09254843 * n.y * n.z,
		0.94617470 * n.z * n.z - 0.31539157, 1.09254843 * n.x * n.z, 0.54627422 * (n.x + n.y) * (n.x - n.y),
	]


## From here on the functions of relight.gdshader, which says what they are: derings the 27 numbers from [param first] on.
static func dering(c: PackedFloat64Array, first: int) -> void:
	var means: PackedFloat64Array = []
	var linear: PackedFloat64Array = []
	var values: PackedFloat64Array = []
	var doubtful := false
	for channel in 3:
		var at := first + channel
		if not c[at] > 0.0:
			for band in range(1, 9):
				c[at + 3 * band] = 0.0
			continue
		var mean := Volumes.COSINE_0 * c[at]
		var one := 0.0
		var two := 0.0
		for band in range(1, 4):
			one += c[at + 3 * band] ** 2
		for band in range(4, 9):
			two += c[at + 3 * band] ** 2
		doubtful = doubtful or Volumes.COSINE_1 * sqrt(one) + 2.0 * Volumes.COSINE_2_ZONAL * sqrt(two) > mean
		means.append(mean)
	if not doubtful:
		return
	for channel in 3:
		if c[first + channel] > 0.0:
			_axes(c, first + channel, linear, values)
	if _border(1.0, 1.0, means, linear, values)[0] >= 1.0:
		return
	var one := 0.0
	var two := 0.0
	for value in range(3, 12):
		one += 4.0 / 9.0 * c[first + value] ** 2
	for value in range(12, 27):
		two += 1.0 / 16.0 * c[first + value] ** 2
	var some := 1e-6 * (one + two)
	one += some
	two += some
	var low := 0.0
	var high := 1.0
	var share_one := 0.0
	var share_two := 0.0
	for bisection in 21:
		var turn := 0.5 * (low + high)
		var border := _border(1.0 - turn, turn, means, linear, values)
		var nearest := (one * (1.0 - turn) + two * turn) / (one * (1.0 - turn) ** 2 + two * turn ** 2)
		var edge := 1.0 / maxf(1.0 - turn, turn)
		var reach := minf(minf(border[0], nearest), edge)
		share_one = reach * (1.0 - turn)
		share_two = reach * turn
		var grows_one := border[1] / maxf(1.0 - turn, 1e-30)
		var grows_two := border[2] / maxf(turn, 1e-30)
		if reach < border[0]:
			grows_one = turn - 1.0 if reach < edge else (-1.0 if turn < 0.5 else 0.0)
			grows_two = -turn if reach < edge else (0.0 if turn < 0.5 else -1.0)
		if one * (1.0 - share_one) * grows_two > two * (1.0 - share_two) * grows_one:
			low = turn
		else:
			high = turn
	for value in range(3, 27):
		c[first + value] *= share_one if value < 12 else share_two


static func _border(one: float, two: float, means: PackedFloat64Array, linear: PackedFloat64Array,
		values: PackedFloat64Array) -> PackedFloat64Array:
	var result: PackedFloat64Array = [1e30, 0.0, 0.0]
	for colour in means.size():
		var least := _least(linear, values, 3 * colour, one, two)
		var reach := means[colour] / -least.y if least.y < 0.0 else 1e30
		if reach < result[0]:
			result = [reach, least.x, least.y - least.x]
	return result


static func _least(linear: PackedFloat64Array, values: PackedFloat64Array, at: int, one: float, two: float) -> Vector2:
	var l0 := one * linear[at]
	var l1 := one * linear[at + 1]
	var l2 := one * linear[at + 2]
	var v0 := two * values[at]
	var v1 := two * values[at + 1]
	var v2 := two * values[at + 2]
	var low := maxf(0.5 * absf(l0) - v0, maxf(0.5 * absf(l1) - v1, 0.5 * absf(l2) - v2))
	var shift := low
	for step in 9:
		var g0 := maxf(v0 + shift, 1e-30)
		var g1 := maxf(v1 + shift, 1e-30)
		var g2 := maxf(v2 + shift, 1e-30)
		var p0 := 0.5 * l0 / g0
		var p1 := 0.5 * l1 / g1
		var p2 := 0.5 * l2 / g2
		var square := p0 * p0 + p1 * p1 + p2 * p2
		var slope := p0 * p0 / g0 + p1 * p1 / g1 + p2 * p2 / g2
		if slope <= 0.0 or step == 8:
			var first := -(l0 * p0 + l1 * p1 + l2 * p2)
			return Vector2(first, 0.5 * first - shift)
		shift = maxf(low, shift + (sqrt(square) - 1.0) * square / slope)
	return Vector2.ZERO


static func _axes(c: PackedFloat64Array, at: int, linear: PackedFloat64Array, values: PackedFloat64Array) -> void:
	var zonal := Volumes.COSINE_2_ZONAL * c[at + 18]
	var across := 0.5 * Volumes.COSINE_2 * c[at + 24]
	var half := 0.5 * Volumes.COSINE_2
	var m: PackedFloat64Array = [
		across - zonal, half * c[at + 12], half * c[at + 21], half * c[at + 12], -across - zonal, half * c[at + 15],
		half * c[at + 21], half * c[at + 15], 2.0 * zonal,
	]
	var l: PackedFloat64Array = [Volumes.COSINE_1 * c[at + 9], Volumes.COSINE_1 * c[at + 3], Volumes.COSINE_1 * c[at + 6]]
	for sweep in 4:
		for turn: Vector3i in [Vector3i(0, 1, 2), Vector3i(0, 2, 1), Vector3i(1, 2, 0)]:
			var p := turn.x
			var q := turn.y
			var r := turn.z
			var pq := m[3 * p + q]
			if absf(pq) <= 1e-12 * (absf(m[4 * p]) + absf(m[4 * q])):
				continue
			var ratio := (m[4 * q] - m[4 * p]) / (2.0 * pq)
			var t := (-1.0 if ratio < 0.0 else 1.0) / (absf(ratio) + sqrt(ratio * ratio + 1.0))
			var co := 1.0 / sqrt(t * t + 1.0)
			var si := t * co
			m[4 * p] -= t * pq
			m[4 * q] += t * pq
			m[3 * p + q] = 0.0
			m[3 * q + p] = 0.0
			var rp := m[3 * r + p]
			var rq := m[3 * r + q]
			m[3 * r + p] = co * rp - si * rq
			m[3 * p + r] = m[3 * r + p]
			m[3 * r + q] = si * rp + co * rq
			m[3 * q + r] = m[3 * r + q]
			var lp := l[p]
			l[p] = co * lp - si * l[q]
			l[q] = si * lp + co * l[q]
	linear.append_array(l)
	values.append_array([m[0], m[4], m[8]])


static func _vector(row: Array) -> Vector3:
	return Vector3(row[0], row[1], row[2])
