@tool
extends RefCounted
## RTGI's probe volumes: their textures, the uniforms of irradiance.gdshaderinc, and the same lookup for scripts.

## Where the probes' own axes lie in the world; the lookup follows it.
var world_from_local := Transform3D.IDENTITY
## One of each volume, finest first.
var volumes: Array[Volume] = []


class Volume:
	var name: String
	var size: Vector4i  ## resolution x, y, z and side of a tile
	var centre: Vector3
	var bias: float
	var lattice_from_offset: Transform3D
	var offset_from_lattice: Transform3D
	var probes: Texture3D
	var distances: Texture3D
	var places: PackedColorArray  ## per probe: from lattice point to probe, 1 if it holds light
	var harmonics: PackedVector3Array  ## per probe: nine SH of radiance
	var moments: PackedVector2Array  ## tiles, row after row of the distances' slices
	var row_length: int
	var rows: int


## Reads [param folder]/probes.json and the textures that it names. An error names what is missing.
func open(folder: String) -> Error:
	volumes.clear()
	var path := folder.path_join("probes.json")
	var text := FileAccess.get_file_as_string(path)
	var index: Variant = JSON.parse_string(text)
	if index is not Dictionary:
		push_error("RTGI: %s is missing or damaged: export again" % path)
		return ERR_FILE_CANT_READ
	for entry: Dictionary in index["volumes"]:
		var volume := Volume.new()
		var resolution: Array = entry["resolution"]
		volume.name = entry["name"]
		volume.size = Vector4i(resolution[0], resolution[1], resolution[2], entry["tile"])
		volume.centre = Vector3(entry["centre"][0], entry["centre"][1], entry["centre"][2])
		volume.bias = entry["bias"]
		volume.lattice_from_offset = _transform(entry["lattice_from_offset"])
		volume.offset_from_lattice = _transform(entry["offset_from_lattice"])
		volume.probes = load(folder.path_join(entry["probes"])) as Texture3D
		volume.distances = load(folder.path_join(entry["distances"])) as Texture3D
		if volume.probes == null or volume.distances == null:
			push_error("RTGI: the textures of volume %s in %s are not imported as Texture3D" % [volume.name, folder])
			return ERR_FILE_MISSING_DEPENDENCIES
		volumes.append(volume)
	return OK


## Sets the uniforms of [param material], whose shader includes irradiance.gdshaderinc.
func apply_to(material: ShaderMaterial) -> void:
	material.set_shader_parameter("rtgi_local_from_world", Projection(world_from_local.affine_inverse()))
	for number in volumes.size():
		var volume := volumes[number]
		material.set_shader_parameter("rtgi_probes_%d" % number, volume.probes)
		material.set_shader_parameter("rtgi_distances_%d" % number, volume.distances)
		material.set_shader_parameter("rtgi_lattice_from_offset_%d" % number, Projection(volume.lattice_from_offset))
		material.set_shader_parameter("rtgi_offset_from_lattice_%d" % number, Projection(volume.offset_from_lattice))
		material.set_shader_parameter("rtgi_centre_%d" % number,
				Vector4(volume.centre.x, volume.centre.y, volume.centre.z, volume.bias))
		material.set_shader_parameter("rtgi_size_%d" % number, volume.size)
	material.set_shader_parameter("rtgi_ready", not volumes.is_empty())


## Irradiance [W/m^2] at a point of a surface; the first call reads the textures back.
func irradiance(position_world: Vector3, normal_world: Vector3) -> Vector3:
	var local_from_world := world_from_local.affine_inverse()
	var position := local_from_world * position_world
	var normal := (local_from_world.basis * normal_world).normalized()
	var shares: PackedFloat64Array = []
	var total := 0.0
	var left := 1.0
	var nearest := 0
	var nearest_distance := INF
	for number in volumes.size():
		var volume := volumes[number]
		var lattice := volume.lattice_from_offset * (position - volume.centre)
		var covered := _coverage(volume, lattice)
		shares.append(left * covered)
		total += left * covered
		left *= 1.0 - covered
		var distance := _distance(volume, lattice)
		if distance < nearest_distance:
			nearest_distance = distance
			nearest = number
	if total == 0.0 and not volumes.is_empty():
		shares[nearest] = 1.0
		total = 1.0
	var sum := Vector3.ZERO
	for number in volumes.size():
		if shares[number] > 0.0:
			sum += shares[number] / total * _volume_irradiance(volumes[number], position - volumes[number].centre, normal)
	return sum


func _volume_irradiance(volume: Volume, offset: Vector3, normal: Vector3) -> Vector3:
	if volume.places.is_empty():
		_read_back(volume)
	var n := normal
	# Bands of the clamped cosine, times the basis.
	var basis: PackedFloat64Array = [
		0.88622693, 1.02332671 * n.y, 1.02332671 * n.z, 1.02332671 * n.x,
		0.85808553 * n.x * n.y, 0.85808553 * n.y * n.z, 0.74312387 * n.z * n.z - 0.24770796, 0.85808553 * n.x * n.z,
		0.42904276 * (n.x + n.y) * (n.x - n.y),
	]
	var last := Vector3i(volume.size.x, volume.size.y, volume.size.z) - Vector3i.ONE
	var position := (volume.lattice_from_offset * offset).clamp(Vector3.ZERO, Vector3(last))
	var first := Vector3i(position).min((last - Vector3i.ONE).max(Vector3i.ZERO))
	var f := position - Vector3(first)
	var biased := offset + volume.bias * normal
	var sum := Vector3.ZERO
	var total := 0.0
	for corner in 8:
		var step := Vector3i(corner & 1, (corner >> 1) & 1, corner >> 2)
		var cell := (first + step).min(last)
		var along := Vector3(f.x if step.x else 1.0 - f.x, f.y if step.y else 1.0 - f.y, f.z if step.z else 1.0 - f.z)
		var trilinear := along.x * along.y * along.z
		if trilinear == 0.0:
			continue
		var index := (cell.z * volume.size.y + cell.y) * volume.size.x + cell.x
		var place := volume.places[index]
		var probe := volume.offset_from_lattice * Vector3(cell) + Vector3(place.r, place.g, place.b)
		var towards := probe - offset
		var distance := towards.length()
		var wrapped := 0.5 * ((towards.dot(normal) / distance if distance > 0.0 else 1.0) + 1.0)
		var seen := (wrapped * wrapped + 0.2) * _visibility(volume, cell, biased - probe)
		if seen < 0.2:
			seen = seen * seen * seen / 0.04
		var weight := trilinear * ((seen + 1e-4 if place.a != 0.0 else 0.0) + 1e-12)
		total += weight
		for band in 9:
			sum += weight * basis[band] * volume.harmonics[index * 9 + band]
	return (sum / total).max(Vector3.ZERO)


func _visibility(volume: Volume, cell: Vector3i, offset: Vector3) -> float:
	var tile := volume.size.w
	var distance := offset.length()
	if distance <= 1e-6 * volume.bias:
		offset = Vector3.UP
	var position := (_octahedral(offset) + Vector2.ONE) * (0.5 * tile) + Vector2(0.5, 0.5)
	var low := Vector2i(position).clamp(Vector2i.ZERO, Vector2i(tile, tile))
	var f := position - Vector2(low)
	var texel := (cell.z * volume.rows + cell.y * (tile + 2) + low.y) * volume.row_length + cell.x * (tile + 2) + low.x
	var below := volume.moments[texel].lerp(volume.moments[texel + 1], f.x)
	var above := volume.moments[texel + volume.row_length].lerp(volume.moments[texel + volume.row_length + 1], f.x)
	var blended := below.lerp(above, f.y)
	var behind := distance - blended.x
	if behind <= 0.0:
		return 1.0
	var variance := absf(blended.y - blended.x * blended.x)
	var bound := variance / maxf(variance + behind * behind, 1.1754944e-38)
	return bound * bound * bound


static func _octahedral(direction: Vector3) -> Vector2:
	var length := absf(direction.x) + absf(direction.y) + absf(direction.z)
	var xy := Vector2(direction.x, -direction.z) / length
	if direction.y >= 0.0:
		return xy
	return Vector2((1.0 - absf(xy.y)) * (-1.0 if xy.x < 0.0 else 1.0), (1.0 - absf(xy.x)) * (-1.0 if xy.y < 0.0 else 1.0))


static func _coverage(volume: Volume, lattice: Vector3) -> float:
	var covered := 1.0
	for axis in 3:
		var count: int = volume.size[axis]
		covered = minf(covered, minf(lattice[axis] + 0.5, count - 0.5 - lattice[axis]) / minf(0.5 * count, 1.0))
	return clampf(covered, 0.0, 1.0)


static func _distance(volume: Volume, lattice: Vector3) -> float:
	var high := Vector3(volume.size.x, volume.size.y, volume.size.z) - Vector3(0.5, 0.5, 0.5)
	return (volume.offset_from_lattice.basis * (lattice.clamp(Vector3(-0.5, -0.5, -0.5), high) - lattice)).length()


## What the GPU reads, for scripts.
static func _read_back(volume: Volume) -> void:
	var count := Vector3i(volume.size.x, volume.size.y, volume.size.z)
	var slices := slices_of(volume.probes)
	volume.places.resize(count.x * count.y * count.z)
	volume.harmonics.resize(volume.places.size() * 9)
	var index := 0
	for z in count.z:
		for y in count.y:
			for x in count.x:
				volume.places[index] = slices[z].get_pixel(x, y)
				for half in 2:
					var red := slices[(1 + half) * count.z + z].get_pixel(x, y)
					var green := slices[(3 + half) * count.z + z].get_pixel(x, y)
					var blue := slices[(5 + half) * count.z + z].get_pixel(x, y)
					for band in 4:
						volume.harmonics[index * 9 + half * 4 + band] = Vector3(red[band], green[band], blue[band])
				var ninth := slices[7 * count.z + z].get_pixel(x, y)
				volume.harmonics[index * 9 + 8] = Vector3(ninth.r, ninth.g, ninth.b)
				index += 1
	slices = slices_of(volume.distances)
	volume.row_length = slices[0].get_width()
	volume.rows = slices[0].get_height()
	volume.moments.clear()
	for z in count.z:
		for row in volume.rows:
			for column in volume.row_length:
				var moment := slices[z].get_pixel(column, row)
				volume.moments.append(Vector2(moment.r, moment.g))


## The slices of an imported texture, from the imported file: without a rendering driver (--headless) Godot keeps none, and the
## Compatibility renderer gives them back in 8 bits.
static func slices_of(texture: Texture3D) -> Array[Image]:
	var slices: Array[Image] = []
	var settings := ConfigFile.new()
	settings.load(texture.resource_path + ".import")
	var file := FileAccess.open(settings.get_value("remap", "path", ""), FileAccess.READ)
	if file == null:
		push_error("RTGI: %s is not imported" % texture.resource_path)
		return slices
	file.seek(8)
	var count := file.get_32()
	file.seek(36)
	for number in count:
		file.get_32()
		var width := file.get_16()
		var height := file.get_16()
		file.get_32()
		var format := file.get_32() as Image.Format
		var empty := Image.create_empty(width, height, false, format)
		slices.append(Image.create_from_data(width, height, false, format, file.get_buffer(empty.get_data_size())))
	return slices


static func _transform(rows: Array) -> Transform3D:
	var columns: Array[Vector3] = []
	for column in 4:
		columns.append(Vector3(rows[0][column], rows[1][column], rows[2][column]))
	return Transform3D(columns[0], columns[1], columns[2], columns[3])
