@tool
extends RefCounted
## RTGI's sphere probes: their maps, the uniforms of irradiance.gdshaderinc, and the same look-up for scripts.

const Volumes := preload("volumes.gd")
const ROWS := 8

## Where the probes' own axes lie in the world: turned and moved, not scaled.
var world_from_local := Transform3D.IDENTITY
var names: Array = []
var texture: Texture3D
var _table: PackedVector4Array = []
var _slices: Array[Image] = []
var _side: int
var _levels: int
var _least: int


## Reads [param folder]/spheres.json and the texture that it names. An error names what is missing.
func open(folder: String) -> Error:
	var index := Volumes.index_of(folder, "spheres.json")
	if index.is_empty():
		return ERR_FILE_CANT_READ
	names = index["names"]
	_side = int(index["side"])
	_levels = int(index["levels"])
	_least = int(index["least"])
	_table.clear()
	for row: Array in index["table"]:
		_table.append(Vector4(row[0], row[1], row[2], row[3]))
	_slices.clear()
	texture = Volumes.texture_of(folder, index["maps"])
	return OK if texture != null else ERR_FILE_MISSING_DEPENDENCIES


## Sets the uniforms of [param material], whose shader includes irradiance.gdshaderinc.
func apply_to(material: ShaderMaterial) -> void:
	material.set_shader_parameter("rtgi_spheres_local_from_world", Projection(world_from_local.affine_inverse()))
	material.set_shader_parameter("rtgi_sphere_table", _table)
	material.set_shader_parameter("rtgi_sphere_maps", texture)
	material.set_shader_parameter("rtgi_spheres_ready", texture != null)


## Radiance [W/(sr m^2)] that a surface of that roughness mirrors from a direction, times the share that the probes know (a).
func mirrored(position_world: Vector3, direction_world: Vector3, roughness: float) -> Color:
	var local_from_world := world_from_local.affine_inverse()
	var position := local_from_world * position_world
	var direction := (local_from_world.basis * direction_world).normalized()
	var total := Vector3.ZERO
	var left := 1.0
	for probe in names.size():
		var share := left * _influence(probe, position)
		if share > 0.0:
			var towards := _parallax(probe, position, direction, roughness * roughness)
			var level := clampf(log(maxf(towards.w, 1e-12) * 0.5 * _side) / log(2.0), 0.0, _levels - 1.0)
			var low := mini(int(level), _levels - 2)
			var way := Vector3(towards.x, towards.y, towards.z)
			total += share * _level(probe, low, way).lerp(_level(probe, low + 1, way), level - low)
			left -= share
	return Color(total.x, total.y, total.z, 1.0 - left)


func _row(probe: int, row: int) -> Vector4:
	return _table[probe * ROWS + row]


func _point(probe: int, row: int, point: Vector4) -> Vector3:
	return Vector3(_row(probe, row).dot(point), _row(probe, row + 1).dot(point), _row(probe, row + 2).dot(point))


func _influence(probe: int, position: Vector3) -> float:
	var unit := _point(probe, 0, Vector4(position.x, position.y, position.z, 1.0))
	var size := unit.abs()
	var reach := maxf(size.x, maxf(size.y, size.z)) if _row(probe, 7).x > 0.5 else unit.length()
	return clampf((1.0 - reach) * _row(probe, 6).w, 0.0, 1.0)


func _parallax(probe: int, position: Vector3, direction: Vector3, alpha: float) -> Vector4:
	var start := _point(probe, 3, Vector4(position.x, position.y, position.z, 1.0))
	var along := _point(probe, 3, Vector4(direction.x, direction.y, direction.z, 0.0))
	var reach := 1e30
	var met := true
	if _row(probe, 7).y > 0.5:
		var near := -1e30
		for axis in 3:
			if along[axis] == 0.0:
				met = met and absf(start[axis]) <= 1.0
			else:
				var one := (-1.0 - start[axis]) / along[axis]
				var other := (1.0 - start[axis]) / along[axis]
				near = maxf(near, minf(one, other))
				reach = minf(reach, maxf(one, other))
		met = met and near <= reach and reach > 0.0
	else:
		var a := along.dot(along)
		var b := start.dot(along)
		var root := b * b - a * (start.dot(start) - 1.0)
		reach = (sqrt(maxf(root, 0.0)) - b) / a
		met = root > 0.0 and reach > 0.0
	if not met:
		return Vector4(direction.x, direction.y, direction.z, alpha)
	var row := _row(probe, 6)
	var towards := position + direction * reach - Vector3(row.x, row.y, row.z)
	var away := towards.length()
	if away <= 1e-12:
		towards = direction
	return Vector4(towards.x, towards.y, towards.z, clampf(alpha * reach / maxf(away, 1e-12), 0.0, 1.0))


func _level_side(level: int) -> int:
	return maxi(_side >> maxi(level - 2, mini(level, 1)), _least)


func _level(probe: int, level: int, direction: Vector3) -> Vector3:
	if _slices.is_empty():
		_slices = Volumes.slices_of(texture)
	var row := 0
	for below in level:
		row += _level_side(below) + 2
	var side := _level_side(level)
	# Maps keep the bake's axes, with z up.
	var d := Vector3(direction.x, -direction.z, direction.y)
	var xy := Vector2(d.x, d.y) / (absf(d.x) + absf(d.y) + absf(d.z))
	if d.z < 0.0:
		xy = Vector2((1.0 - absf(xy.y)) * (-1.0 if xy.x < 0.0 else 1.0), (1.0 - absf(xy.x)) * (-1.0 if xy.y < 0.0 else 1.0))
	var place := (xy + Vector2.ONE) * (0.5 * side) + Vector2(0.5, 0.5)
	var low := Vector2i(place).clamp(Vector2i.ZERO, Vector2i(side, side))
	var f := place - Vector2(low)
	var slice := _slices[probe]
	low.y += row
	var first := slice.get_pixel(low.x, low.y).lerp(slice.get_pixel(low.x + 1, low.y), f.x)
	var second := slice.get_pixel(low.x, low.y + 1).lerp(slice.get_pixel(low.x + 1, low.y + 1), f.x)
	var found := first.lerp(second, f.y)
	return _row(probe, 7).z * Vector3(found.r, found.g, found.b)
