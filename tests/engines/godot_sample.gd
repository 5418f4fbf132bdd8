extends SceneTree
## Draws the sample scene in scene-linear RGB of float32, row after row: after `--`, the file, the side, and `ball` to show the ball.


func _initialize() -> void:
	var words := OS.get_cmdline_user_args()
	var size := int(words[1])
	var viewport := SubViewport.new()
	viewport.size = Vector2i(size, size)
	viewport.own_world_3d = true
	viewport.use_hdr_2d = true
	viewport.msaa_3d = Viewport.MSAA_4X
	viewport.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	root.add_child(viewport)
	var scene: Node = (load("res://sample.tscn") as PackedScene).instantiate()
	viewport.add_child(scene)
	scene.get_node("Ball").visible = words.size() > 2
	for frame in 90 if words.size() > 2 else 5:
		await RenderingServer.frame_post_draw
	print("lamps ", scene.find_children("*", "Light3D", true, false).size(), ", camera ", viewport.get_camera_3d().name)
	var image := viewport.get_texture().get_image()
	image.convert(Image.FORMAT_RGBF)
	FileAccess.open(words[0], FileAccess.WRITE).store_buffer(image.get_data())
	quit()
