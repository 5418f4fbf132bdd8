extends Node3D
## model.glb under the probes' light, or white balls at the probes where there is no model; a dynamic ball flies through.

const MODEL := "res://model.glb"
const SKY := "res://sky.exr"
## What the panorama's pixels are to be multiplied by.
const SKY_SCALE := 1.0
const MOST_BALLS := 512

@onready var probes: Node3D = $Probes

var _path: Array[Vector3] = []


func _ready() -> void:
	var index: Dictionary = JSON.parse_string(FileAccess.get_file_as_string("res://rtgi/probes.json"))
	if ResourceLoader.exists(MODEL):
		var model: Node = (load(MODEL) as PackedScene).instantiate()
		add_child(model)
		var lamps := _by_node(index["lamps"])
		for lamp: Light3D in model.find_children("*", "Light3D", true, false):
			_set_up(lamp, lamps.get(lamp.name, "all" if index["includes_direct"] and lamps.is_empty() else "bounces"))
		var objects := _by_node(index["objects"])
		for mesh: MeshInstance3D in model.find_children("*", "MeshInstance3D", true, false):
			if objects.get(mesh.name) == "dynamic":
				mesh.gi_mode = GeometryInstance3D.GI_MODE_DYNAMIC  # it receives light, and the bake does not know it
		for camera: Camera3D in model.find_children("*", "Camera3D", true, false):
			camera.make_current()
			break
	else:
		_add_balls()
	if ResourceLoader.exists(SKY):
		_show_sky(load(SKY) as Texture2D)
	var finest: Vector3 = probes.volumes.volumes[0].offset_from_lattice.basis.get_scale().abs()
	$Ball.scale = Vector3.ONE * minf(finest.x, minf(finest.y, finest.z))
	if get_viewport().get_camera_3d() == $Camera:
		_frame_volumes()
	probes.refresh()


func _process(_delta: float) -> void:
	if _path.is_empty():
		for volume in probes.volumes.volumes:
			var size := Vector3(volume.size.x, volume.size.y, volume.size.z)
			for corner: Vector3 in [Vector3(0.3, 0.3, 0.3), Vector3(0.7, 0.3, 0.4), Vector3(0.7, 0.6, 0.7), Vector3(0.3, 0.5, 0.6)]:
				_path.append(volume.centre + volume.offset_from_lattice * (corner * size - Vector3(0.5, 0.5, 0.5)))
	if not _path.is_empty():
		var time := Time.get_ticks_msec() / 2000.0
		var leg := int(time) % _path.size()
		$Ball.position = _path[leg].lerp(_path[(leg + 1) % _path.size()], smoothstep(0.0, 1.0, fposmod(time, 1.0)))


## Behind the model alone: the probes hold its light.
func _show_sky(panorama: Texture2D) -> void:
	var material := PanoramaSkyMaterial.new()
	material.panorama = panorama
	material.energy_multiplier = SKY_SCALE
	var environment: Environment = $Environment.environment
	environment.sky = Sky.new()
	environment.sky.sky_material = material
	environment.background_mode = Environment.BG_SKY


## What the bake says of Blender's objects, by the names of the nodes that they became.
func _by_node(roles: Dictionary) -> Dictionary:
	var result := {}
	for blender_name: String in roles:
		result[StringName(blender_name.validate_node_name())] = roles[blender_name]
	return result


## glTF's watts per steradian and per square metre, as Blender's exporter writes them, in Godot's unit; with shadows. What the probes
## hold of a lamp is not given twice.
func _set_up(lamp: Light3D, baked: String) -> void:
	if baked == "all":
		lamp.queue_free()
		return
	lamp.light_bake_mode = Light3D.BAKE_DISABLED if baked == "none" else Light3D.BAKE_DYNAMIC
	lamp.light_energy /= PI
	lamp.shadow_enabled = true
	if lamp is OmniLight3D or lamp is SpotLight3D:
		# glTF lamps have no end, and shadows are as coarse as the range is large.
		var parameter := Light3D.PARAM_RANGE
		lamp.set_param(parameter, minf(lamp.get_param(parameter), 8.0 * _box().size.length()))


func _add_balls() -> void:
	var count := 0
	for volume in probes.volumes.volumes:
		var cell: Vector3 = volume.offset_from_lattice.basis.get_scale().abs()
		var ball := SphereMesh.new()
		ball.radius = 0.2 * minf(cell.x, minf(cell.y, cell.z))
		ball.height = 2.0 * ball.radius
		for z in volume.size.z:
			for y in volume.size.y:
				for x in volume.size.x:
					if count < MOST_BALLS:
						_show(ball, volume.centre + volume.offset_from_lattice * Vector3(x, y, z))
						count += 1
	var box := _box()
	var floor_mesh := PlaneMesh.new()
	floor_mesh.size = 1.5 * Vector2(box.size.x, box.size.z)
	_show(floor_mesh, box.get_center() - Vector3(0.0, 0.5 * box.size.y, 0.0))


func _show(mesh: Mesh, place: Vector3) -> void:
	var instance := MeshInstance3D.new()
	instance.mesh = mesh
	instance.position = place
	add_child(instance)


func _frame_volumes() -> void:
	var box := _box()
	var direction := Vector3(0.5, 0.35, 0.8).normalized()
	$Camera.look_at_from_position(box.get_center() + box.size.length() * direction, box.get_center())


## Around all volumes.
func _box() -> AABB:
	var box := AABB()
	for volume in probes.volumes.volumes:
		var size := Vector3(volume.size.x, volume.size.y, volume.size.z)
		var own: AABB = volume.offset_from_lattice * AABB(Vector3(-0.5, -0.5, -0.5), size)
		own.position += volume.centre
		box = own if box.size == Vector3.ZERO else box.merge(own)
	return box
