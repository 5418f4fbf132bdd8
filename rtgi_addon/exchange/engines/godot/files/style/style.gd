@tool
extends MeshInstance3D
## RTGI's style over the picture of the camera that sees this node: lines, paper and grading. Values are those of style.json, ramps
## those of style_ramps.png, both beside this script. Needs Forward+.

const COLORS := ["shadow_color", "paper_color", "tint", "line_color"]


func _ready() -> void:
	var folder: String = (get_script() as Script).resource_path.get_base_dir()
	var square := QuadMesh.new()
	square.size = Vector2(2.0, 2.0)
	mesh = square
	extra_cull_margin = 16384.0
	cast_shadow = GeometryInstance3D.SHADOW_CASTING_SETTING_OFF
	var material := ShaderMaterial.new()
	material.shader = load(folder.path_join("style_view.gdshader"))
	# Behind all else that is transparent.
	material.render_priority = Material.RENDER_PRIORITY_MIN
	apply_to(material, folder)
	material_override = material


## Give any material whose shader includes style.gdshaderinc the values of the style.
static func apply_to(material: ShaderMaterial, folder: String) -> void:
	var values: Variant = JSON.parse_string(FileAccess.get_file_as_string(folder.path_join("style.json")))
	if values is not Dictionary:
		push_error("style.json is missing or damaged: export again")
		return
	for key: String in values["style"]:
		var value: Variant = values["style"][key]
		material.set_shader_parameter("style_" + key, Vector3(value[0], value[1], value[2]) if key in COLORS else value)
	material.set_shader_parameter("style_ramps", load(folder.path_join("style_ramps.png")))
