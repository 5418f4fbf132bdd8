@tool
extends Node
## Other light on RTGI's probes, without a new bake: suns, skies and groups of lights, some of the probes in every frame.
##
## Put relight.tscn beside probes.tscn. What surfaces reflect of [member sun] follows it; set [member factors] to dim or colour lights
## of the bake. Works in Forward+, Mobile and Compatibility: probes are drawn into a SubViewport, which irradiance.gdshaderinc reads.

## All probes have followed what shines.
signal followed

const Volumes := preload("volumes.gd")
const Relit := preload("relit.gd")
const SHADER := preload("relight.gdshader")

## The node with probes.gd.
@export var probes: NodePath = ^"../Probes"
## A DirectionalLight3D whose bounced light takes the place of the file's suns; none: `suns`.
@export var sun: NodePath
## In how many frames all probes follow.
@export_range(1, 64) var parts := 8
## Dynamic objects and `volumes.irradiance` follow too, on a thread of their own; that takes longer.
@export var follow_in_scripts := true
## Follow in every frame; off: where a script calls `update`.
@export var every_frame := true

## Factors by the names of the bake's lights ("world", "suns" and groups; names are in rtgi/transfer.json): a number, Color or Vector3.
var factors := {}
## In place of the file's suns (null: those), an array of {"towards": Vector3, "irradiance": Vector3 in W/m^2}, along the world's axes.
var suns: Variant = null
## In place of the baked world (null: that), {"harmonics": [[r, g, b], ...], "suns": [[r, g, b], ...]} along the probes' axes.
var sky: Variant = null
var relit := Relit.new()
var volumes: Volumes
## The light atlas beside the probes (atlas.gd), if there is one and it knows what its texels make of any light: all of it follows at
## once.
var atlas: RefCounted
var _atlas_target: Target
var _targets: Array[Target] = []
var _rows := PackedFloat32Array()  # what is being drawn
var _shown: Variant = null  # what has been drawn
var _part := -1
var _task := -1
var _computed: Array[PackedVector3Array] = []
var _computing := PackedFloat32Array()
var _in_scripts: Variant = null


class Target:
	var viewport: SubViewport
	var material: ShaderMaterial


func _ready() -> void:
	# Probes that come later in the tree open their volumes after this.
	_find_probes.call_deferred()


func _find_probes() -> void:
	var node := get_node_or_null(probes) if is_inside_tree() else null
	if volumes == null and node != null and node.get("volumes") != null and not node.volumes.volumes.is_empty():
		set_up(node.volumes, _own_folder(), node.get("atlas"))
		node.show_volumes()


func _exit_tree() -> void:
	_wait()


func _process(_delta: float) -> void:
	if every_frame and volumes != null:
		update()


func _own_folder() -> String:
	return (get_script() as Script).resource_path.get_base_dir()


## For other nodes than probes.gd: relights [param of_volumes], whose export lies in [param folder], and its light atlas.
func set_up(of_volumes: Volumes, folder: String, of_atlas: RefCounted = null) -> Error:
	var error := relit.open(folder)
	if error != OK:
		return error
	if relit.tables.size() != of_volumes.volumes.size():
		push_error("RTGI: %s has another transfer than probes: copy all files of one export" % folder)
		return ERR_FILE_CORRUPT
	volumes = of_volumes
	for number in volumes.volumes.size():
		_targets.append(_target(volumes.volumes[number], number))
		volumes.volumes[number].shown = _targets[number].viewport.get_texture()
	if of_atlas == null or not FileAccess.file_exists(folder.path_join("atlas_transfer.json")):
		return OK
	of_atlas.relit = Relit.new()
	error = of_atlas.relit.open(folder, "atlas_transfer.json")
	if error == OK:
		atlas = of_atlas
		_atlas_target = _drawn(load(_own_folder().path_join("atlas_relight.gdshader")), atlas.relit.tables[0],
				Vector2i(atlas.texture.get_width(), 3 * atlas.texture.get_height()))
		atlas.shown = _atlas_target.viewport.get_texture()
	return error


func _target(volume: Volumes.Volume, number: int) -> Target:
	var size: Vector2i = volume.sheet
	var result := _drawn(SHADER, relit.tables[number], size)
	result.material.set_shader_parameter("baked", volume.probes)
	result.material.set_shader_parameter("down", relit.down[number])
	result.material.set_shader_parameter("size", Vector3i(volume.size.x, volume.size.y, volume.size.z))
	result.material.set_shader_parameter("area", size)
	return result


## What is drawn by [param shader] from [param table] into a picture of [param size].
func _drawn(shader: Shader, table: Texture3D, size: Vector2i) -> Target:
	var result := Target.new()
	result.material = ShaderMaterial.new()
	result.material.shader = shader
	result.material.set_shader_parameter("table", table)
	result.viewport = SubViewport.new()
	result.viewport.size = size
	result.viewport.disable_3d = true
	result.viewport.use_hdr_2d = true
	result.viewport.transparent_bg = true  # its fourth channel counts
	result.viewport.render_target_clear_mode = SubViewport.CLEAR_MODE_NEVER
	result.viewport.render_target_update_mode = SubViewport.UPDATE_DISABLED
	var canvas := ColorRect.new()
	canvas.size = size
	canvas.material = result.material
	result.viewport.add_child(canvas)
	add_child(result.viewport, false, Node.INTERNAL_MODE_BACK)
	return result


## Draws the next of the probes, and returns whether all have followed what shines now.
func update() -> bool:
	if _part < 0:
		var rows := relit.entries(_factors(), _suns(), sky)
		if _shown != null and rows == _shown:
			_follow_in_scripts()
			return true
		# Taken once for all parts, so that all of them fit together. The first time at once: nothing has been drawn yet.
		_rows = rows
		_part = 0
		_upload(_targets, _rows)
		if atlas != null:
			_follow_with_atlas()
			_upload([_atlas_target], atlas.rows)
			_atlas_target.viewport.render_target_update_mode = SubViewport.UPDATE_ONCE
	var count := 1 if _shown == null else parts
	for target in _targets:
		var height := target.viewport.size.y
		target.material.set_shader_parameter("rows", Vector2i(height * _part / count, height * (_part + 1) / count))
		target.viewport.render_target_update_mode = SubViewport.UPDATE_ONCE
	_part += 1
	if _part >= count:
		_part = -1
		_shown = _rows
		followed.emit()
	return _part < 0


func _follow_with_atlas() -> void:
	if atlas != null:
		atlas.rows = atlas.relit.entries(_factors(), _suns(), atlas.relit.sky_of(sky, relit))


## What shines as a texture of three texels a row.
static func _upload(targets: Array[Target], rows: PackedFloat32Array) -> void:
	var count := rows.size() / Relit.ENTRY
	var padded := rows.duplicate()
	if count == 0:
		padded.resize(Relit.ENTRY)
	var image := Image.create_from_data(3, maxi(count, 1), false, Image.FORMAT_RGBAF, padded.to_byte_array())
	var entries := ImageTexture.create_from_image(image)
	for target in targets:
		target.material.set_shader_parameter("entries", entries)
		target.material.set_shader_parameter("entry_count", count)


func _factors() -> Dictionary:
	var result := {}
	for light: String in factors:
		if not relit.lights.any(func(known: Dictionary) -> bool: return known["name"] == light):
			push_error("RTGI: there is no light \"%s\": choose one of %s" % [light,
					", ".join(relit.lights.map(func(known: Dictionary) -> String: return known["name"]))])
			continue
		result[light] = _light(factors[light])
	return result


func _suns() -> Variant:
	var lamp := get_node_or_null(sun) as DirectionalLight3D if not sun.is_empty() and is_inside_tree() else null
	if lamp == null and suns == null:
		return null
	var back := volumes.world_from_local.basis.orthonormalized().inverse()
	var result := []
	if lamp != null:
		var colour := lamp.light_color.srgb_to_linear()
		var energy := PI * lamp.light_energy if lamp.is_visible_in_tree() else 0.0
		result.append({"towards": back * lamp.global_basis.z.normalized(), "irradiance": energy * Vector3(colour.r, colour.g, colour.b)})
	for other: Dictionary in suns if suns != null else []:
		result.append({"towards": back * other["towards"], "irradiance": _light(other["irradiance"])})
	return result


static func _light(value: Variant) -> Vector3:
	if value is Color:
		return Vector3(value.r, value.g, value.b)
	return value if value is Vector3 else float(value) * Vector3.ONE


## What scripts and dynamic objects read, on a thread.
func _follow_in_scripts() -> void:
	if _task >= 0:
		if not WorkerThreadPool.is_task_completed(_task):
			return
		_wait()
		_in_scripts = _computing
		volumes.replace_harmonics(_computed)
		var node := get_node_or_null(probes) if is_inside_tree() else null
		if node != null and node.has_method("show_harmonics"):
			node.show_harmonics()
	elif follow_in_scripts and (_in_scripts == null or _in_scripts != _shown):
		_computing = _shown
		_task = WorkerThreadPool.add_task(_compute.bind(_sizes(), _computing.duplicate()), false, "RTGI relight")


## The same at once, for scripts that cannot wait.
func follow_now() -> void:
	_wait()
	_computing = relit.entries(_factors(), _suns(), sky)
	_follow_with_atlas()
	_compute(_sizes(), _computing)
	_in_scripts = _computing
	volumes.replace_harmonics(_computed)


func _compute(sizes: Array, rows: PackedFloat32Array) -> void:
	var result: Array[PackedVector3Array] = []
	for number in sizes.size():
		result.append(relit.harmonics(number, sizes[number], rows))
	_computed = result


func _sizes() -> Array:
	return volumes.volumes.map(func(volume: Volumes.Volume) -> Vector3i: return Vector3i(volume.size.x, volume.size.y, volume.size.z))


func _wait() -> void:
	if _task >= 0:
		WorkerThreadPool.wait_for_task_completion(_task)
		_task = -1
