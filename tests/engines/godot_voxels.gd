extends SceneTree
## Draws a ball of voxel_surface.gdshader before a camera: what it is lit by, as a mean over the picture.


func _initialize() -> void:
	var voxels: RefCounted = load("res://rtgi/voxels.gd").new()
	voxels.open("res://rtgi")
	var material := ShaderMaterial.new()
	material.shader = load("res://rtgi/voxel_surface.gdshader")
	voxels.apply_to(material)
	var ball := MeshInstance3D.new()
	ball.mesh = SphereMesh.new()
	ball.scale = Vector3.ONE * 0.5
	ball.position = Vector3(-1.0, 0.0, 0.0)
	ball.material_override = material
	root.add_child(ball)
	var camera := Camera3D.new()
	camera.position = Vector3(-1.0, 0.0, 0.8)
	root.add_child(camera)
	for frame in 4:
		await RenderingServer.frame_post_draw
	var image := root.get_texture().get_image()
	image.resize(1, 1, Image.INTERPOLATE_LANCZOS)
	print("mean ", image.get_pixel(0, 0).get_luminance())
	quit()
