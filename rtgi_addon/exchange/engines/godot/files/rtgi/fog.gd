@tool
extends Node3D
## Shows RTGI's media: as Godot's volumetric fog, which its lamps light, where the renderer has that (Forward+); else, or where
## [member how] says so, by a march of its own that is exact and knows the baked ambient light alone.
##
## Fog volumes and the view are made when the scene starts and are not saved; the environment in use is given the world's medium
## in the game, not in the editor. The node may be moved and turned.

enum How { AUTOMATIC, FOG, VIEW }

const Media := preload("media.gd")
const FOG_VOLUME := preload("fog_volume.gdshader")
const VIEW := preload("media_view.gdshader")

@export var how := How.AUTOMATIC:
	set(value):
		how = value
		if is_node_ready():
			_show()
## Steps of the march along a pixel's ray.
@export_range(4, 256) var steps := 48

var media := Media.new()
var _made: Array[Node] = []
var _volumes: Array[ShaderMaterial] = []


func _ready() -> void:
	if media.open((get_script() as Script).resource_path.get_base_dir()) != OK:
		return
	set_notify_transform(true)
	_show()


func _notification(what: int) -> void:
	if what == NOTIFICATION_TRANSFORM_CHANGED and is_node_ready() and media.ambient != null:
		_show()


func _process(_delta: float) -> void:
	if _volumes.is_empty():
		return
	var camera := get_viewport().get_camera_3d()
	if Engine.is_editor_hint():
		camera = Engine.get_singleton(&"EditorInterface").get_editor_viewport_3d().get_camera_3d()
	if camera != null:
		for material in _volumes:
			material.set_shader_parameter("fog_camera", camera.global_position)


func _show() -> void:
	for node in _made:
		node.queue_free()
	_made.clear()
	_volumes.clear()
	media.world_from_local = global_transform
	var forward := RenderingServer.get_current_rendering_method() == "forward_plus"
	if how == How.FOG or (how == How.AUTOMATIC and forward):
		_show_fog()
	else:
		_show_view()
	for node in _made:
		add_child(node)


func _show_fog() -> void:
	if media.scatters_everywhere():
		_made.append(media.fog_volume(null, FOG_VOLUME))
	for box in media.boxes:
		_made.append(media.fog_volume(box, FOG_VOLUME))
	for volume: FogVolume in _made:
		_volumes.append(volume.material)
	if not Engine.is_editor_hint():
		_set_up_environment.call_deferred()


func _set_up_environment() -> void:
	var environment := get_world_3d().environment
	if environment == null:
		push_warning("RTGI: volumetric fog needs an Environment: add a WorldEnvironment to the scene")
		return
	media.apply_to_environment(environment)


func _show_view() -> void:
	var material := ShaderMaterial.new()
	material.shader = VIEW
	# Behind all that is transparent otherwise it would hide it.
	material.render_priority = Material.RENDER_PRIORITY_MIN
	material.set_shader_parameter("view_steps", steps)
	media.apply_to(material)
	var square := MeshInstance3D.new()
	square.name = "View"
	square.mesh = QuadMesh.new()
	square.mesh.size = Vector2(2.0, 2.0)
	square.mesh.material = material
	square.gi_mode = GeometryInstance3D.GI_MODE_DYNAMIC
	square.cast_shadow = GeometryInstance3D.SHADOW_CASTING_SETTING_OFF
	square.custom_aabb = AABB(Vector3.ONE * -1e6, Vector3.ONE * 2e6)
	_made.append(square)
