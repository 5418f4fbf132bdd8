@tool
extends RefCounted
## RTGI's probe volumes: their textures, the uniforms of irradiance.gdshaderinc, and the same lookup for scripts.

# The numbers of irradiance.gdshaderinc.
const SIDE_FLOOR := 0.2
const CRUSH_BELOW := 0.2
const UNSEEN_FLOOR := 1e-6
const DILATED_FLOOR := 1e-12
const LIFT := 0.2
const AT_PROBE := 1e-6
const TINY := 1.17549435e-38
const WORD := 256
const SHARES := 255
const COSINE_0 := 0.886226925
const COSINE_1 := 1.02332671
const COSINE_2 := 0.858085531
const COSINE_2_ZONAL := 0.247707956

## Where the probes' own axes lie in the world; the lookup follows it.
var world_from_local := Transform3D.IDENTITY
## One of each volume, finest first.
var volumes: Array[Volume] = []


class Volume:
	var name: String
	var size: Vector4i  ## resolution x, y, z of the probes as they lie in textures, and side of a tile
	var nodes: Vector3i  ## of what is looked up: the probes themselves, or what names scattered ones
	var names: Texture3D  ## what the nodes of a scattered volume name; else null
	var words: PackedColorArray  ## the same, for scripts
	var centre: Vector3
	var bias: float
	var lattice_from_offset: Transform3D
	var offset_from_lattice: Transform3D
	var probes: Texture3D
	var shown: Texture2D  ## what is drawn with where light changes at run time: the slices of `probes` side by side, as in the file
	var sheet: Vector2i  ## its size
	var distances: Texture3D
	var places: PackedColorArray  ## per probe: from lattice point to probe, its scale, negative if it holds no light
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
		volume.nodes = Vector3i(resolution[0], resolution[1], resolution[2])
		if entry.has("words"):
			volume.nodes = Vector3i(entry["nodes"][0], entry["nodes"][1], entry["nodes"][2])
			volume.names = load(folder.path_join(entry["words"])) as Texture3D
			if volume.names == null:
				push_error("RTGI: the nodes of volume %s in %s are not imported as Texture3D" % [volume.name, folder])
				return ERR_FILE_MISSING_DEPENDENCIES
		volume.centre = Vector3(entry["centre"][0], entry["centre"][1], entry["centre"][2])
		volume.bias = entry["bias"]
		volume.lattice_from_offset = _transform(entry["lattice_from_offset"])
		volume.offset_from_lattice = _transform(entry["offset_from_lattice"])
		volume.probes = load(folder.path_join(entry["probes"])) as Texture3D
		volume.distances = load(folder.path_join(entry["distances"])) as Texture3D
		if volume.probes == null or volume.distances == null:
			push_error("RTGI: the textures of volume %s in %s are not imported as Texture3D" % [volume.name, folder])
			return ERR_FILE_MISSING_DEPENDENCIES
		if entry.has("sheet"):
			volume.sheet = Vector2i(entry["sheet"][0], entry["sheet"][1])
			volume.shown = _sheet(volume)
		volumes.append(volume)
	return OK


## The probes as a picture, for exports whose light can change (relight.gd).
static func _sheet(volume: Volume) -> ImageTexture:
	var sheet := Image.create_empty(volume.sheet.x, volume.sheet.y, false, Image.FORMAT_RGBAH)
	var slices := slices_of(volume.probes)
	var columns := volume.sheet.x / volume.size.x
	for number in slices.size():
		sheet.blit_rect(slices[number], Rect2i(0, 0, volume.size.x, volume.size.y),
				Vector2i(number % columns * volume.size.x, number / columns * volume.size.y))
	return ImageTexture.create_from_image(sheet)


## Nine harmonics of each probe, by volume, in place of those that were baked, for scripts.
func replace_harmonics(of_volumes: Array[PackedVector3Array]) -> void:
	for number in volumes.size():
		if volumes[number].places.is_empty():
			_read_back(volumes[number])
		volumes[number].harmonics = of_volumes[number]


## Sets the uniforms of [param material], whose shader includes irradiance.gdshaderinc.
func apply_to(material: ShaderMaterial) -> void:
	material.set_shader_parameter("rtgi_local_from_world", Projection(world_from_local.affine_inverse()))
	for number in volumes.size():
		var volume := volumes[number]
		material.set_shader_parameter("rtgi_probes_%d" % number, volume.probes if volume.shown == null else volume.shown)
		material.set_shader_parameter("rtgi_distances_%d" % number, volume.distances)
		material.set_shader_parameter("rtgi_lattice_from_offset_%d" % number, Projection(volume.lattice_from_offset))
		material.set_shader_parameter("rtgi_offset_from_lattice_%d" % number, Projection(volume.offset_from_lattice))
		material.set_shader_parameter("rtgi_centre_%d" % number,
				Vector4(volume.centre.x, volume.centre.y, volume.centre.z, volume.bias))
		material.set_shader_parameter("rtgi_size_%d" % number, volume.size)
		material.set_shader_parameter("rtgi_nodes_%d" % number,
				Vector4i(volume.nodes.x, volume.nodes.y, volume.nodes.z, 0 if volume.names == null else 1))
		if volume.names != null:
			material.set_shader_parameter("rtgi_words_%d" % number, volume.names)
	material.set_shader_parameter("rtgi_ready", not volumes.is_empty())


## Irradiance [W/m^2] at a point of a surface; the first call reads the textures back. Where [param normal_world] is that of a normal
## map, [param surface_normal_world] is the surface's own; left out, they are one.
func irradiance(position_world: Vector3, normal_world: Vector3, surface_normal_world := Vector3.ZERO) -> Vector3:
	var local_from_world := world_from_local.affine_inverse()
	var position := local_from_world * position_world
	var normal := (local_from_world.basis * normal_world).normalized()
	var surface_normal := (local_from_world.basis * surface_normal_world).normalized() if surface_normal_world else normal
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
			sum += shares[number] / total * _volume_irradiance(volumes[number], position - volumes[number].centre, normal, surface_normal)
	return sum


func _volume_irradiance(volume: Volume, offset: Vector3, normal: Vector3, surface_normal: Vector3) -> Vector3:
	if volume.places.is_empty():
		_read_back(volume)
	var basis := _cosine_basis(normal)
	var last := volume.nodes - Vector3i.ONE
	var lifted := offset + LIFT * volume.bias * surface_normal
	var position := (volume.lattice_from_offset * lifted).clamp(Vector3.ZERO, Vector3(last))
	var first := Vector3i(position).min((last - Vector3i.ONE).max(Vector3i.ZERO))
	var f := position - Vector3(first)
	var biased := offset + volume.bias * surface_normal
	var sum := Vector3.ZERO
	var total := 0.0
	for corner in 8:
		var step := Vector3i(corner & 1, (corner >> 1) & 1, corner >> 2)
		var cell := (first + step).min(last)
		var along := Vector3(f.x if step.x else 1.0 - f.x, f.y if step.y else 1.0 - f.y, f.z if step.z else 1.0 - f.z)
		var trilinear := along.x * along.y * along.z
		if trilinear == 0.0:
			continue
		var node := (cell.z * volume.nodes.y + cell.y) * volume.nodes.x + cell.x
		var origin := volume.offset_from_lattice * Vector3(cell) if volume.names == null else Vector3.ZERO
		for named: Array in _named(volume, node):
			var index: int = named[0]
			var place := volume.places[index]
			var probe := origin + Vector3(place.r, place.g, place.b)
			var seen := _side_weight(probe - offset, surface_normal) * _visibility(volume, index, biased - probe)
			var weight := _probe_weight(trilinear * named[1], seen, named[2] and place.a > 0.0)
			total += weight
			for band in 9:
				sum += weight * basis[band] * volume.harmonics[index * 9 + band]
	return (sum / total).max(Vector3.ZERO)


## What a node names: of each probe its index, its share, and whether it is meant and does not stand in for others.
static func _named(volume: Volume, node: int) -> Array[Array]:
	if volume.names == null:
		return [[node, 1.0, true]]
	var found: Array[Array] = []
	for slot in 4:
		var word := int(volume.words[node][slot])
		if word != 0:
			found.append([absi(word) / WORD, float(absi(word) % WORD) / SHARES, word > 0])
	return found


## What light_data.tres holds of the probes: nine colours of radiance over pi for each of its points, which are the probes and once
## more the outermost ones on the faces of the box.
func light_data_harmonics() -> PackedColorArray:
	var result := PackedColorArray()
	for volume in volumes:
		var size := volume.nodes
		for z in size.z + 2:
			for y in size.y + 2:
				for x in size.x + 2:
					var cell := (Vector3i(x, y, z) - Vector3i.ONE).clamp(Vector3i.ZERO, size - Vector3i.ONE)
					var named := _named(volume, (cell.z * size.y + cell.y) * size.x + cell.x)
					for band in 9:
						var value := Vector3.ZERO
						for one: Array in named:
							value += one[1] * volume.harmonics[9 * one[0] + band] / PI
						result.append(Color(value.x, value.y, value.z))
	return result


## How surely the probe [param index] sees the point at [param offset] from it.
func _visibility(volume: Volume, index: int, offset: Vector3) -> float:
	var cell := Vector3i(index % volume.size.x, index / volume.size.x % volume.size.y, index / (volume.size.x * volume.size.y))
	var tile := volume.size.w
	var distance := offset.length()
	var direction := Vector3.UP if distance <= AT_PROBE * volume.bias else offset
	var position := (_octahedral(direction) + Vector2.ONE) * (0.5 * tile) + Vector2(0.5, 0.5)
	var low := Vector2i(position).clamp(Vector2i.ZERO, Vector2i(tile, tile))
	var f := position - Vector2(low)
	var texel := (cell.z * volume.rows + cell.y * (tile + 2) + low.y) * volume.row_length + cell.x * (tile + 2) + low.x
	var below := volume.moments[texel].lerp(volume.moments[texel + 1], f.x)
	var above := volume.moments[texel + volume.row_length].lerp(volume.moments[texel + volume.row_length + 1], f.x)
	return _seen_share(distance, below.lerp(above, f.y))


# From here on the functions of irradiance.gdshaderinc, which says what they are.
static func _seen_share(distance: float, moments: Vector2) -> float:
	var behind := distance - moments.x
	var variance := absf(moments.y - moments.x * moments.x)
	var share := 0.5 - 0.5 * behind / sqrt(maxf(variance + behind * behind, TINY))
	return share * share


static func _side_weight(towards_probe: Vector3, surface_normal: Vector3) -> float:
	var distance := towards_probe.length()
	var wrapped := 0.5 * ((towards_probe.dot(surface_normal) / distance if distance > 0.0 else 1.0) + 1.0)
	return wrapped * wrapped + SIDE_FLOOR


static func _probe_weight(trilinear: float, seen: float, live: bool) -> float:
	var crushed := seen * seen * seen / (CRUSH_BELOW * CRUSH_BELOW) if seen < CRUSH_BELOW else seen
	return trilinear * ((crushed + UNSEEN_FLOOR if live else 0.0) + DILATED_FLOOR)


static func _cosine_basis(n: Vector3) -> PackedFloat64Array:
	return [
		COSINE_0, COSINE_1 * n.y, COSINE_1 * n.z, COSINE_1 * n.x,
		COSINE_2 * n.x * n.y, COSINE_2 * n.y * n.z, COSINE_2_ZONAL * (3.0 * n.z * n.z - 1.0), COSINE_2 * n.x * n.z,
		0.5 * COSINE_2 * (n.x + n.y) * (n.x - n.y),
	]


static func _octahedral(direction: Vector3) -> Vector2:
	var length := absf(direction.x) + absf(direction.y) + absf(direction.z)
	var xy := Vector2(direction.x, -direction.z) / length
	if direction.y >= 0.0:
		return xy
	return Vector2((1.0 - absf(xy.y)) * (-1.0 if xy.x < 0.0 else 1.0), (1.0 - absf(xy.x)) * (-1.0 if xy.y < 0.0 else 1.0))


static func _coverage(volume: Volume, lattice: Vector3) -> float:
	var covered := 1.0
	for axis in 3:
		var count: int = volume.nodes[axis]
		covered = minf(covered, minf(lattice[axis] + 0.5, count - 0.5 - lattice[axis]) / minf(0.5 * count, 1.0))
	return clampf(covered, 0.0, 1.0)


static func _distance(volume: Volume, lattice: Vector3) -> float:
	var high := Vector3(volume.nodes) - Vector3(0.5, 0.5, 0.5)
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
				var scale := absf(volume.places[index].a)
				for half in 2:
					var red := slices[(1 + half) * count.z + z].get_pixel(x, y)
					var green := slices[(3 + half) * count.z + z].get_pixel(x, y)
					var blue := slices[(5 + half) * count.z + z].get_pixel(x, y)
					for band in 4:
						volume.harmonics[index * 9 + half * 4 + band] = scale * Vector3(red[band], green[band], blue[band])
				var ninth := slices[7 * count.z + z].get_pixel(x, y)
				volume.harmonics[index * 9 + 8] = scale * Vector3(ninth.r, ninth.g, ninth.b)
				index += 1
	if volume.names != null:
		volume.words.clear()
		for slice in slices_of(volume.names):
			for row in slice.get_height():
				for column in slice.get_width():
					volume.words.append(slice.get_pixel(column, row))
	slices = slices_of(volume.distances)
	volume.row_length = slices[0].get_width()
	volume.rows = slices[0].get_height()
	volume.moments.clear()
	for z in count.z:
		for row in volume.rows:
			for column in volume.row_length:
				var moment := slices[z].get_pixel(column, row)
				volume.moments.append(Vector2(moment.r, moment.g))


## What the file [param name] of [param folder] says; empty, with an error, where it is missing.
static func index_of(folder: String, name: String, remedy := "export again") -> Dictionary:
	var path := folder.path_join(name)
	var index: Variant = JSON.parse_string(FileAccess.get_file_as_string(path))
	if index is Dictionary:
		return index
	push_error("RTGI: %s is missing or damaged: %s" % [path, remedy])
	return {}


## The texture [param name] of [param folder]; null, with an error, where it is not imported.
static func texture_of(folder: String, name: String) -> Texture3D:
	var texture := load(folder.path_join(name)) as Texture3D
	if texture == null:
		push_error("RTGI: %s is not imported as Texture3D" % folder.path_join(name))
	return texture


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
