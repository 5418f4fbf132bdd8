@tool
extends Node3D
## Lights what is below [member target] by RTGI's probes, in the editor and in the game.
##
## Meshes whose GI mode is Dynamic keep their materials and are lit as a whole, by the LightmapGIData of the child node. All others
## are lit at every pixel: a ShaderMaterial that includes irradiance.gdshaderinc gets its uniforms, a StandardMaterial3D without
## transparency is drawn with surface.gdshader in its place. Nothing of that is saved into the scene.

const Volumes := preload("volumes.gd")
const TurnedLight := preload("turned_light.gd")
const ONE_SIDED := preload("surface.gdshader")
const DOUBLE_SIDED := preload("surface_double_sided.gdshader")

## The part of the scene that is lit.
@export var target: NodePath = ^".."
## Draw StandardMaterial3D with surface.gdshader; off: only your own shaders are set up.
@export var convert_materials := true:
	set(value):
		convert_materials = value
		if is_node_ready() and is_inside_tree():
			_restore()
			refresh()

var volumes := Volumes.new()
## The sphere probes (spheres.gd), or null where the bake has none.
var spheres: RefCounted
## The light atlas (atlas.gd), or null where the bake has none. Objects in it that have materials of their own shaders keep those.
var atlas: RefCounted
var _converted := {}  # [BaseMaterial3D, part of the atlas] -> the ShaderMaterial that stands in for it
var _shown: Array[ShaderMaterial] = []  # every material that was given the uniforms
var _turned: LightmapGIData
var _turned_instance: RID
var _placing := false
var _drawn_otherwise := {}  # MeshInstance3D -> true: those with stand-ins


func _enter_tree() -> void:
	if is_node_ready():
		refresh()
		_place_light.call_deferred()


func _exit_tree() -> void:
	_restore()
	_free_turned()


func _ready() -> void:
	var folder := (get_script() as Script).resource_path.get_base_dir()
	if volumes.open(folder) != OK:
		return
	volumes.world_from_local = global_transform
	if ResourceLoader.exists(folder.path_join("spheres.gd")):
		spheres = load(folder.path_join("spheres.gd")).new()
		if spheres.open(folder) != OK:
			spheres = null
	if ResourceLoader.exists(folder.path_join("atlas.gd")):
		atlas = load(folder.path_join("atlas.gd")).new()
		if atlas.open(folder) != OK:
			atlas = null
	set_notify_transform(true)
	get_tree().node_added.connect(_on_node_added)
	refresh()
	_place_light.call_deferred()


func _notification(what: int) -> void:
	if what == NOTIFICATION_TRANSFORM_CHANGED and is_node_ready():
		if not _placing:
			_placing = true
			_place_light.call_deferred()
		volumes.world_from_local = global_transform
		for material in _shown:
			_set_up(material)


## Dynamic objects are lit by the child node, which follows this one; where it is turned, by a turned copy of its light.
func _place_light() -> void:
	_placing = false
	_free_turned()
	var node := get_node_or_null(^"DynamicObjects") as LightmapGI
	if not is_inside_tree() or node == null or node.light_data == null:
		return
	var turned := not global_transform.basis.orthonormalized().is_equal_approx(Basis.IDENTITY)
	RenderingServer.instance_set_visible(node.get_instance(), node.is_visible_in_tree() and not turned)
	if turned and node.is_visible_in_tree():
		_turned = TurnedLight.placed(node.light_data, global_transform)
		_turned_instance = RenderingServer.instance_create2(_turned.get_rid(), get_world_3d().scenario)


func _free_turned() -> void:
	if _turned != null:
		RenderingServer.free_rid(_turned_instance)
		_turned = null


## Gives materials the uniforms again, after the textures of `volumes` were replaced.
func show_volumes() -> void:
	for material in _shown:
		volumes.apply_to(material)


## Gives dynamic objects the light that `volumes` now hold for scripts.
func show_harmonics() -> void:
	var node := get_node_or_null(^"DynamicObjects") as LightmapGI
	if node == null or node.light_data == null:
		return
	var content: Dictionary = node.light_data.get("probe_data").duplicate()
	content["sh"] = volumes.light_data_harmonics()
	var data := LightmapGIData.new()
	data.set("probe_data", content)
	node.light_data = data
	_place_light()


## Looks for meshes and materials again: call it after materials were replaced.
func refresh() -> void:
	var root := get_node_or_null(target)
	if root is MeshInstance3D:
		_light(root)
	if root != null:
		for node in root.find_children("*", "MeshInstance3D", true, false):
			_light(node)


func _on_node_added(node: Node) -> void:
	if not is_inside_tree():
		return
	var root := get_node_or_null(target)
	if node is MeshInstance3D and root != null and root.is_ancestor_of(node):
		_light.call_deferred(node)


func _light(mesh: MeshInstance3D) -> void:
	if not is_instance_valid(mesh) or mesh.mesh == null or mesh.gi_mode == GeometryInstance3D.GI_MODE_DYNAMIC:
		return
	for surface in mesh.mesh.get_surface_count():
		var material := mesh.get_active_material(surface)
		if material is ShaderMaterial:
			_show(material)
			continue
		var stand_in := _stand_in(material, "" if atlas == null else atlas.part_of(mesh))
		if stand_in == null:
			continue
		_drawn_otherwise[mesh] = true
		if mesh.material_override != null:
			RenderingServer.instance_geometry_set_material_override(mesh.get_instance(), stand_in.get_rid())
		else:
			RenderingServer.instance_set_surface_override_material(mesh.get_instance(), surface, stand_in.get_rid())


## Draws all meshes with their own materials again.
func _restore() -> void:
	for mesh: Variant in _drawn_otherwise:
		if not is_instance_valid(mesh) or mesh.mesh == null:
			continue
		RenderingServer.instance_geometry_set_material_override(mesh.get_instance(), _rid(mesh.material_override))
		for surface in mesh.get_surface_override_material_count():
			RenderingServer.instance_set_surface_override_material(mesh.get_instance(), surface,
					_rid(mesh.get_surface_override_material(surface)))
	_drawn_otherwise.clear()


static func _rid(material: Material) -> RID:
	return material.get_rid() if material != null else RID()


func _show(material: ShaderMaterial) -> void:
	if material not in _shown and material.shader != null and material.get_shader_parameter("rtgi_ready") != true:
		for uniform in material.shader.get_shader_uniform_list():
			if uniform["name"] == "rtgi_ready":
				_shown.append(material)
				_set_up(material)
				return


## The material that is drawn for a StandardMaterial3D or ORMMaterial3D (none: the engine's default), or null to leave it alone;
## objects in the light atlas have one of their own.
func _stand_in(material: Material, part: String) -> ShaderMaterial:
	if not convert_materials:
		return null
	if _converted.has([material, part]):
		return _converted[[material, part]]
	var source := material as BaseMaterial3D
	if material != null and (source == null or source.transparency != BaseMaterial3D.TRANSPARENCY_DISABLED
			or source.shading_mode == BaseMaterial3D.SHADING_MODE_UNSHADED):
		return null
	if source == null:
		source = StandardMaterial3D.new()
	var result := ShaderMaterial.new()
	result.shader = DOUBLE_SIDED if source.cull_mode == BaseMaterial3D.CULL_DISABLED else ONE_SIDED
	var orm := source is ORMMaterial3D
	var parameters := {
		"albedo": source.albedo_color, "albedo_texture": source.albedo_texture,
		"metallic": 1.0 if orm else source.metallic,
		"metallic_texture": source.orm_texture if orm else source.metallic_texture,
		"metallic_channel": _channel(BaseMaterial3D.TEXTURE_CHANNEL_BLUE if orm else source.metallic_texture_channel),
		"roughness": 1.0 if orm else source.roughness,
		"roughness_texture": source.orm_texture if orm else source.roughness_texture,
		"roughness_channel": _channel(BaseMaterial3D.TEXTURE_CHANNEL_GREEN if orm else source.roughness_texture_channel),
		"specular": source.metallic_specular,
		"normal_mapped": source.normal_enabled and source.normal_texture != null,
		"normal_scale": source.normal_scale, "normal_texture": source.normal_texture,
		"vertex_colors": source.vertex_color_use_as_albedo,
		"uv_scale": source.uv1_scale, "uv_offset": source.uv1_offset,
	}
	if source.emission_enabled:
		parameters["emission"] = source.emission
		parameters["emission_energy"] = source.emission_energy_multiplier
		parameters["emission_texture"] = source.emission_texture
	for parameter: String in parameters:
		if parameters[parameter] != null:
			result.set_shader_parameter(parameter, parameters[parameter])
	_converted[[material, part]] = result
	if part != "":
		result.set_meta(&"rtgi_part", part)
	_shown.append(result)
	_set_up(result)
	return result


func _set_up(material: ShaderMaterial) -> void:
	volumes.apply_to(material)
	if spheres != null:
		spheres.world_from_local = global_transform
		spheres.apply_to(material)
	if atlas != null and material.has_meta(&"rtgi_part"):
		atlas.world_from_local = global_transform
		atlas.apply_to(material, material.get_meta(&"rtgi_part"))


static func _channel(channel: BaseMaterial3D.TextureChannel) -> Vector4:
	if channel == BaseMaterial3D.TEXTURE_CHANNEL_GRAYSCALE:
		return Vector4(1.0, 1.0, 1.0, 0.0) / 3.0
	var result := Vector4.ZERO
	result[channel] = 1.0
	return result
