extends SceneTree
## What the scripts beside this one share: each holds a part of this export to RTGI's own numbers, prints a line for each case, and
## ends with exit code 0 if all pass. With --headless they ask the look-ups in scripts, with a rendering driver also the shaders.

## Where the export is moved to for some of the cases.
const MOVED := Transform3D(Vector3(0.36, 0.48, -0.8), Vector3(-0.8, 0.6, 0.0), Vector3(0.48, 0.64, 0.6), Vector3(-3.0, 5.0, 2.0))
## The cases' places, and what is added to their names there.
const PLACES := [[Transform3D.IDENTITY, ""], [MOVED, ", moved"]]
## Around what a shader shows of `values` in column `column` of a table of points: what a half float holds of each in one row, to whole
## steps of 2^-24, 2048 times the rest in the next.
const SHADER := """shader_type canvas_item;
render_mode unshaded, blend_disabled;
#include "%s"
uniform sampler2D table : filter_nearest;
%s
void fragment() {
	int column = int(UV.x * float(textureSize(table, 0).x));
	vec3 values[%d];
%s
	int row = int(UV.y * float(2 * values.length()));
	vec3 whole = trunc(values[row / 2] * 16777216.0) / 16777216.0;
	vec3 high = uintBitsToFloat(floatBitsToUint(whole) & uvec3(0xffffe000u));
	COLOR = vec4(row %% 2 == 0 ? high : 2048.0 * (values[row / 2] - high), 1.0);
}
"""

var _folder: String = (get_script() as Script).resource_path.get_base_dir()
var _failed := false


func _headless() -> bool:
	return DisplayServer.get_name() == "headless"


## What the file `name` of the kit says; empty, and the end of the run, where it cannot be read.
func _expected(name: String) -> Dictionary:
	var read: Variant = JSON.parse_string(FileAccess.get_file_as_string(_folder.path_join(name)))
	if read is Dictionary:
		return read
	printerr("conformance/%s is missing or damaged: export again" % name)
	quit(1)
	return {}


## The folders of the kit's own light and of the export's.
func _sources() -> Dictionary:
	return {"kit": _folder.path_join("kit"), "bundle": _folder.path_join("../rtgi").simplify_path()}


## Both sources as the add-on's script `file` reads them, which calls them `what`; empty, and the end of the run, where it cannot.
func _opened(file: String, what: String) -> Dictionary:
	var library: GDScript = load(_folder.path_join("../rtgi").path_join(file).simplify_path())
	var sources := _sources()
	var opened := {}
	for source: String in sources:
		opened[source] = library.new()
		if opened[source].open(sources[source]) != OK:
			printerr("FAIL the %s of %s cannot be read: run godot --headless --path . --import first" % [what, sources[source]])
			quit(1)
			return {}
	return opened


## A line on rows of numbers; `slack` widens the tolerance of each.
func _report(name: String, found: Array, expected: Array, tolerance: Array, unit: String, slack := 1.0) -> void:
	var worst := 0.0
	var share := 0.0
	var brightest := 0.0
	for row in expected.size():
		for channel in expected[row].size():
			var error := absf(found[row][channel] - expected[row][channel]) if row < found.size() else INF
			worst = maxf(worst, error if is_finite(error) else INF)
			share = maxf(share, error / maxf(slack * tolerance[row][channel], 1e-9) if is_finite(error) else INF)
			brightest = maxf(brightest, expected[row][channel])
	var passed := share <= 1.0 and not expected.is_empty()
	_failed = _failed or not passed
	print("%s %s: %d points, largest error %.6f of up to %.3f %s, %.2f of the tolerance" % [
			"PASS" if passed else "FAIL", name, expected.size(), worst, brightest, unit, share])


## The last line, and the exit code; `skipped` is what takes a rendering driver.
func _finish(skipped: String) -> void:
	if _headless():
		print("SKIP %s: --headless has no rendering driver" % skipped)
	print("%s: %s" % ["FAIL" if _failed else "PASS", "headless" if _headless() else RenderingServer.get_video_adapter_name()])
	quit(1 if _failed else 0)


## A material that shows `values` vectors, which `body` sets from the table; `include` is a file that it reads, `uniforms` its own.
func _material(include: String, values: int, body: String, uniforms := "") -> ShaderMaterial:
	var material := ShaderMaterial.new()
	material.shader = Shader.new()
	material.shader.code = SHADER % [include, uniforms, values, body]
	return material


## The `values` vectors that `material` shows of each column of `table`.
func _shown(material: ShaderMaterial, table: Image, values: int) -> Array:
	material.set_shader_parameter("table", ImageTexture.create_from_image(table))
	var size := Vector2i(table.get_width(), 2 * values)
	var viewport := _viewport(size)
	var canvas := ColorRect.new()
	canvas.size = size
	canvas.material = material
	viewport.add_child(canvas)
	var image: Image = (await _drawn([viewport], 3))[0]
	var found := []
	for column in size.x:
		var vectors := []
		for number in values:
			var high := image.get_pixel(column, 2 * number)
			var rest := image.get_pixel(column, 2 * number + 1)
			vectors.append(Vector3(high.r + rest.r / 2048.0, high.g + rest.g / 2048.0, high.b + rest.b / 2048.0))
		found.append(vectors)
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


## `columns` of as many colours each as a table that shaders read.
static func _table(columns: Array) -> Image:
	var table := Image.create_empty(columns.size(), columns[0].size(), false, Image.FORMAT_RGBAF)
	for column in columns.size():
		for row in columns[column].size():
			table.set_pixel(column, row, columns[column][row])
	return table


static func _colour(vector: Vector3, w := 1.0) -> Color:
	return Color(vector.x, vector.y, vector.z, w)


static func _vector(row: Array) -> Vector3:
	return Vector3(row[0], row[1], row[2])
