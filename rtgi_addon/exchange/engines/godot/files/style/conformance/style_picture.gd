extends SceneTree
## Holds the lines of this export to those of RTGI's own effect: draws a still life and compares the coverage of lines, pixel by pixel.
## Needs a rendering driver and Forward+; exit code 0 if it passes.

## Coverage that differs by more is wrong, and so large a share of the pixels that have or should have lines may be: normals of the
## screen have 8 bits, and rasterization has its own mind of pixels on an edge.
const OFF := 0.25
const MOST := 0.05

func _initialize() -> void:
	var folder: String = (get_script() as Script).resource_path.get_base_dir()
	var case: Variant = JSON.parse_string(FileAccess.get_file_as_string(folder.path_join("style_picture.json")))
	if case is not Dictionary:
		printerr("style_picture.json is missing or damaged: export again")
		quit(1)
		return
	if DisplayServer.get_name() == "headless" or RenderingServer.get_current_rendering_method() != "forward_plus":
		print("SKIP the style: it needs Forward+ and a rendering driver")
		quit(0)
		return
	var viewport := SubViewport.new()
	viewport.size = Vector2i(int(case["size"][0]), int(case["size"][1]))
	viewport.own_world_3d = true
	viewport.use_hdr_2d = true
	viewport.render_target_update_mode = SubViewport.UPDATE_ALWAYS
	root.add_child(viewport)
	var still_life := MeshInstance3D.new()
	still_life.mesh = _mesh(case["triangles"])
	viewport.add_child(still_life)
	var camera := Camera3D.new()
	var place: Dictionary = case["camera"]
	camera.fov = place["fov"]
	camera.near = place["near"]
	camera.far = place["far"]
	camera.transform = Transform3D(_vector(place["x"]), _vector(place["y"]), _vector(place["z"]), _vector(place["origin"]))
	viewport.add_child(camera)
	camera.make_current()
	viewport.add_child((load(folder.path_join("style/style.tscn")) as PackedScene).instantiate())
	for frame in 6:
		await RenderingServer.frame_post_draw
	var image := viewport.get_texture().get_image()
	var wrong := 0
	var concerned := 0
	var lines := 0.0
	var expected_lines := 0.0
	for row in image.get_height():
		for column in image.get_width():
			var expected: float = case["coverage"][row * image.get_width() + column] / 255.0
			var found := 1.0 - clampf(image.get_pixel(column, row).r, 0.0, 1.0)
			lines += found
			expected_lines += expected
			if expected > OFF or found > OFF:
				concerned += 1
				if absf(found - expected) > OFF:
					wrong += 1
	var passed := expected_lines > 100.0 and wrong <= MOST * concerned
	print("%s lines: %d of %d pixels off by more than %.2f, lines cover %.0f pixels of %.0f" % [
			"PASS" if passed else "FAIL", wrong, concerned, OFF, lines, expected_lines])
	if OS.has_environment("RTGI_STYLE_PICTURE"):
		image.save_exr(OS.get_environment("RTGI_STYLE_PICTURE"))
	quit(0 if passed else 1)


func _mesh(numbers: Array) -> ArrayMesh:
	var tool := SurfaceTool.new()
	tool.begin(Mesh.PRIMITIVE_TRIANGLES)
	for first in range(0, numbers.size(), 9):
		var corners := [Vector3(), Vector3(), Vector3()]
		for corner in 3:
			corners[corner] = Vector3(numbers[first + 3 * corner], numbers[first + 3 * corner + 1], numbers[first + 3 * corner + 2])
		tool.set_normal((corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized())
		# Godot's front faces go the other way round.
		for corner: int in [0, 2, 1]:
			tool.add_vertex(corners[corner])
	return tool.commit()


func _vector(numbers: Array) -> Vector3:
	return Vector3(numbers[0], numbers[1], numbers[2])
