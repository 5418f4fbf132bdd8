extends "irradiance_checks.gd"
## Holds this export to the irradiance that RTGI's own lookup gives: that of volumes.gd on the imported textures, irradiance.gdshaderinc
## on the GPU, and dynamic objects under LightmapGIData.

const SIDE := 16  # pixels of a picture of a dynamic object


func _initialize() -> void:
	var expected := _expected("conformance.json")
	var opened := _opened("volumes.gd", "volumes") if expected else {}
	if opened.is_empty():
		return
	for place: Array in PLACES:
		for case: Dictionary in expected["cases"]:
			var volumes: RefCounted = opened[case["volumes"]]
			volumes.world_from_local = place[0]
			_report(case["name"] + ", script" + place[1], _by_script(case, volumes), case["irradiance"], case["tolerance"], "W/m^2")
			if not _headless():
				_report(case["name"] + ", shader" + place[1], await _by_shader(case, volumes, _sources()[case["volumes"]]),
						case["irradiance"], case["tolerance"], "W/m^2")
		if not _headless():
			var dynamic: Dictionary = expected["dynamic objects"]
			# The Compatibility renderer encodes what it draws in 3D for the screen, which coarsens halves.
			var slack := 2.0 if RenderingServer.get_current_rendering_method() == "gl_compatibility" else 1.0
			_report("dynamic objects" + place[1], await _dynamic_radiance(dynamic, place[0]), dynamic["radiance"], dynamic["tolerance"],
					"W/(sr m^2)", slack)
	_finish("the shader and dynamic objects")


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
