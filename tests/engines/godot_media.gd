extends SceneTree
## What a camera sees of an unshaded wall through the export's media: after `--`, the wall's distance and radiance, and 1 for Godot's
## fog or 2 for the view. Prints the mean of the middle of the picture, scene-linear.

const SIDE := 64


func _initialize() -> void:
	var words := OS.get_cmdline_user_args()
	var viewport := SubViewport.new()
	viewport.size = Vector2i(SIDE, SIDE)
	viewport.own_world_3d = true
	viewport.use_hdr_2d = true
	viewport.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	root.add_child(viewport)
	var world := WorldEnvironment.new()
	world.environment = Environment.new()
	world.environment.background_mode = Environment.BG_COLOR
	world.environment.background_color = Color.BLACK
	world.environment.ambient_light_source = Environment.AMBIENT_SOURCE_DISABLED
	viewport.add_child(world)
	var wall := MeshInstance3D.new()
	wall.mesh = QuadMesh.new()
	wall.mesh.size = Vector2(100.0, 100.0)
	var material := StandardMaterial3D.new()
	material.shading_mode = BaseMaterial3D.SHADING_MODE_UNSHADED
	material.albedo_color = Color(float(words[1]), float(words[1]), float(words[1])).linear_to_srgb()
	wall.mesh.material = material
	wall.position = Vector3(0.0, 0.0, -float(words[0]))
	viewport.add_child(wall)
	var camera := Camera3D.new()
	camera.fov = 2.0
	camera.far = 200.0
	viewport.add_child(camera)
	camera.make_current()
	var media: Node3D = (load("res://rtgi/media.tscn") as PackedScene).instantiate()
	media.how = int(words[2])
	viewport.add_child(media)
	for frame in 60 if words[2] == "1" else 4:
		await RenderingServer.frame_post_draw
	var image := viewport.get_texture().get_image()
	var sum := Vector3.ZERO
	for y in range(SIDE / 4, 3 * SIDE / 4):
		for x in range(SIDE / 4, 3 * SIDE / 4):
			var colour := image.get_pixel(x, y)
			sum += Vector3(colour.r, colour.g, colour.b) / (SIDE * SIDE / 4.0)
	print("found ", sum.x, " ", sum.y, " ", sum.z)
	quit()
