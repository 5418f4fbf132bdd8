extends SceneTree
## Draws the sample scene in scene-linear RGB of float32, row after row: after `--`, the file, the side, `ball` to show the
## ball in the middle, and `turned` to turn the whole scene.


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
	if "turned" in words:
		scene.transform = Transform3D(Basis.from_euler(Vector3(0.4, -1.1, 2.0)), Vector3(-3.0, 5.0, 2.0))
	viewport.add_child(scene)
	await process_frame
	scene.set_process(false)
	var ball: Node3D = scene.get_node("Ball")
	ball.visible = "ball" in words
	ball.position = scene.get_node("Probes").volumes.volumes[0].centre
	for frame in 90 if ball.visible else 5:
		await RenderingServer.frame_post_draw
	print("lamps ", scene.find_children("*", "Light3D", true, false).size(), ", camera ", viewport.get_camera_3d().name)
	for lamp: Light3D in scene.find_children("*", "Light3D", true, false):
		print("lamp ", lamp.name, " bakes ", lamp.light_bake_mode)
	for mesh: MeshInstance3D in scene.find_children("*", "MeshInstance3D", true, false):
		print("mesh ", mesh.name, " mode ", mesh.gi_mode)
	var image := viewport.get_texture().get_image()
	image.convert(Image.FORMAT_RGBF)
	FileAccess.open(words[0], FileAccess.WRITE).store_buffer(image.get_data())
	quit()
