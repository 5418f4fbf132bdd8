extends SceneTree
## Holds this export to the irradiance that RTGI's own lookup gives: prints a line for each case, exit code 0 if all pass.
##
## With --headless the lookup of volumes.gd on the imported textures; with a rendering driver also irradiance.gdshaderinc on the
## GPU and dynamic objects under LightmapGIData.

const SIDE := 16  # pixels of a picture of a dynamic object
## Where the probes are moved to for one of the cases.
const MOVED := Transform3D(Vector3(0.36, 0.48, -0.8), Vector3(-0.8, 0.6, 0.0), Vector3(0.48, 0.64, 0.6), Vector3(-3.0, 5.0, 2.0))

var _folder: String
var _failed := false


func _initialize() -> void:
	_folder = (get_script() as Script).resource_path.get_base_dir()
	var expected: Variant = JSON.parse_string(FileAccess.get_file_as_string(_folder.path_join("conformance.json")))
	if expected is not Dictionary:
		printerr("conformance.json is missing or damaged: export again")
		quit(1)
		return
	var library: GDScript = load(_folder.path_join("../rtgi/volumes.gd").simplify_path())
	var sources := {"kit": _folder.path_join("kit"), "bundle": _folder.path_join("../rtgi").simplify_path()}
	var opened := {}
	for source: String in sources:
		opened[source] = library.new()
		if opened[source].open(sources[source]) != OK:
			printerr("FAIL the volumes of %s cannot be read: run godot --headless --path . --import first" % sources[source])
			quit(1)
			return
	var cases := [[Transform3D.IDENTITY, ""], [MOVED, ", moved"]]
	for place: Array in cases:
		for case: Dictionary in expected["cases"]:
			var volumes: RefCounted = opened[case["volumes"]]
			volumes.world_from_local = place[0]
			_report(case["name"] + ", script" + place[1], _script_irradiance(case, volumes), case, "irradiance")
	if DisplayServer.get_name() == "headless":
		print("SKIP the shader and dynamic objects: --headless has no rendering driver")
	else:
		for place: Array in cases:
			for case: Dictionary in expected["cases"]:
				var volumes: RefCounted = opened[case["volumes"]]
				volumes.world_from_local = place[0]
				_report(case["name"] + ", shader" + place[1], await _shader_irradiance(case, volumes, sources[case["volumes"]]),
						case, "irradiance")
			var dynamic: Dictionary = expected["dynamic objects"]
			_report("dynamic objects" + place[1], await _dynamic_radiance(dynamic, place[0]), dynamic, "radiance")
	print("%s: %s" % ["FAIL" if _failed else "PASS", RenderingServer.get_video_adapter_name() if DisplayServer.get_name() != "headless"
			else "headless"])
	quit(1 if _failed else 0)


func _report(name: String, found: Array, case: Dictionary, quantity: String) -> void:
	var expected: Array = case[quantity]
	var tolerance: Array = case["tolerance"]
	var unit := "W/m^2" if quantity == "irradiance" else "W/(sr m^2)"
	# The Compatibility renderer encodes what it draws in 3D for the screen, which coarsens halves.
	var encoded := quantity == "radiance" and RenderingServer.get_current_rendering_method() == "gl_compatibility"
	var slack := 2.0 if encoded else 1.0
	var worst := 0.0
	var share := 0.0
	var brightest := 0.0
	for row in expected.size():
		for channel in 3:
			var error := absf(found[row][channel] - expected[row][channel]) if row < found.size() else INF
			worst = maxf(worst, error if is_finite(error) else INF)
			share = maxf(share, error / maxf(slack * tolerance[row][channel], 1e-9) if is_finite(error) else INF)
			brightest = maxf(brightest, expected[row][channel])
	var passed := share <= 1.0 and not expected.is_empty()
	_failed = _failed or not passed
	print("%s %s: %d points, largest error %.6f of up to %.3f %s, %.2f of the tolerance" % [
			"PASS" if passed else "FAIL", name, expected.size(), worst, brightest, unit, share])


func _script_irradiance(case: Dictionary, volumes: RefCounted) -> Array:
	var found := []
	for row in case["points"].size():
		found.append(volumes.irradiance(volumes.world_from_local * _vector(case["points"][row]),
				volumes.world_from_local.basis * _vector(case["normals"][row])))
	return found


## Each point a column of two pixels in half floats: the irradiance as far as a half holds it, and 2048 times the rest.
func _shader_irradiance(case: Dictionary, volumes: RefCounted, folder: String) -> Array:
	var count: int = case["points"].size()
	var table := Image.create_empty(count, 2, false, Image.FORMAT_RGBAF)
	for row in count:
		var point: Vector3 = volumes.world_from_local * _vector(case["points"][row])
		var normal: Vector3 = volumes.world_from_local.basis * _vector(case["normals"][row])
		table.set_pixel(row, 0, Color(point.x, point.y, point.z))
		table.set_pixel(row, 1, Color(normal.x, normal.y, normal.z))
	var shader := Shader.new()
	shader.code = """shader_type canvas_item;
render_mode unshaded, blend_disabled;
#include "%s"
uniform sampler2D table : filter_nearest;
void fragment() {
	int column = int(UV.x * float(textureSize(table, 0).x));
	vec3 value = rtgi_irradiance(texelFetch(table, ivec2(column, 0), 0).xyz, texelFetch(table, ivec2(column, 1), 0).xyz);
	vec3 high = uintBitsToFloat(floatBitsToUint(value) & uvec3(0xffffe000u));
	COLOR = vec4(UV.y < 0.5 ? high : 2048.0 * (value - high), 1.0);
}
""" % folder.path_join("irradiance.gdshaderinc")
	var material := ShaderMaterial.new()
	material.shader = shader
	material.set_shader_parameter("table", ImageTexture.create_from_image(table))
	volumes.apply_to(material)
	var viewport := _viewport(Vector2i(count, 2))
	var canvas := ColorRect.new()
	canvas.size = Vector2(count, 2)
	canvas.material = material
	viewport.add_child(canvas)
	var image: Image = (await _drawn([viewport], 3))[0]
	var found := []
	for column in count:
		var high := image.get_pixel(column, 0)
		var rest := image.get_pixel(column, 1)
		found.append([high.r + rest.r / 2048.0, high.g + rest.g / 2048.0, high.b + rest.b / 2048.0])
	return found


## What white squares show that stand at the points and face along the normals, lit by the kit's LightmapGIData alone.
func _dynamic_radiance(case: Dictionary, place: Transform3D) -> Array:
	var world := World3D.new()
	world.environment = Environment.new()
	world.environment.background_mode = Environment.BG_COLOR
	world.environment.background_color = Color.BLACK
	world.environment.ambient_light_source = Environment.AMBIENT_SOURCE_DISABLED
	world.environment.reflected_light_source = Environment.REFLECTION_SOURCE_DISABLED
	var material := StandardMaterial3D.new()
	material.metallic_specular = 0.0
	var viewports: Array[SubViewport] = []
	for row in case["points"].size():
		var point := place * _vector(case["points"][row])
		var normal := place.basis * _vector(case["normals"][row])
		var viewport := _viewport(Vector2i(SIDE, SIDE))
		viewport.world_3d = world
		if row == 0:
			var light := LightmapGI.new()
			light.light_data = load(_folder.path_join("kit/light_data.tres"))
			if place != Transform3D.IDENTITY:
				var turned_light: GDScript = load(_folder.path_join("../rtgi/turned_light.gd").simplify_path())
				light.light_data = turned_light.placed(light.light_data, place)
			viewport.add_child(light)
		var facing := Basis.looking_at(-normal, Vector3.UP if absf(normal.y) < 0.9 else Vector3.RIGHT)
		var square := MeshInstance3D.new()
		square.mesh = QuadMesh.new()
		square.mesh.size = Vector2(0.02, 0.02)
		square.mesh.material = material
		square.gi_mode = GeometryInstance3D.GI_MODE_DYNAMIC
		square.transform = Transform3D(facing, point)
		viewport.add_child(square)
		var camera := Camera3D.new()
		camera.projection = Camera3D.PROJECTION_ORTHOGONAL
		camera.size = 0.01
		camera.near = 0.001
		camera.far = 0.02
		camera.transform = Transform3D(facing, point + 0.01 * normal)
		viewport.add_child(camera)
		camera.make_current()
		viewports.append(viewport)
	# Godot lets captured light follow gradually.
	var images: Array[Image] = await _drawn(viewports, 90)
	var found := []
	for image in images:
		var colour := image.get_pixel(SIDE / 2, SIDE / 2)
		if RenderingServer.get_current_rendering_method() == "gl_compatibility":
			colour = colour.srgb_to_linear()  # this renderer encodes what it draws in 3D
		found.append([colour.r, colour.g, colour.b])
	return found


func _viewport(size: Vector2i) -> SubViewport:
	var viewport := SubViewport.new()
	viewport.size = size
	viewport.use_hdr_2d = true
	viewport.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	root.add_child(viewport)
	return viewport


func _drawn(viewports: Array[SubViewport], frames: int) -> Array[Image]:
	for frame in frames:
		await RenderingServer.frame_post_draw
	var images: Array[Image] = []
	for viewport in viewports:
		images.append(viewport.get_texture().get_image())
		viewport.queue_free()
	return images


static func _vector(row: Array) -> Vector3:
	return Vector3(row[0], row[1], row[2])
