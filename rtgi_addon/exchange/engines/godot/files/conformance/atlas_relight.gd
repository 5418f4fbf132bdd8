extends "atlas_checks.gd"
## Holds the light atlas under other light to RTGI's own numbers: the arithmetic of atlas.gd on the imported tables, and
## atlas_relight.gdshader on the GPU, as relight.gd has them follow.

const Shining := preload("shining.gd")


func _initialize() -> void:
	var expected := _expected("atlas_relight.json")
	var opened := _opened("atlas.gd", "light atlas") if expected else {}
	if opened.is_empty():
		return
	var library := func(file: String) -> GDScript: return load(_folder.path_join("../rtgi").path_join(file).simplify_path())
	for part: Dictionary in expected["sets"]:
		var source: String = _sources()[part["atlas"]]
		var atlas: RefCounted = opened[part["atlas"]]
		var volumes: RefCounted = library.call("volumes.gd").new()
		var relight: Node = library.call("relight.gd").new()
		relight.follow_in_scripts = false
		relight.every_frame = false
		root.add_child(relight)
		if volumes.open(source) != OK or relight.set_up(volumes, source, atlas) != OK or relight.atlas == null:
			printerr("FAIL the transfer of %s cannot be read: run godot --headless --path . --import first" % source)
			quit(1)
			return
		for number in part["cases"].size():
			var case: Dictionary = part["cases"][number]
			# Every other lighting with the export elsewhere.
			volumes.world_from_local = MOVED if number % 2 else Transform3D.IDENTITY
			atlas.world_from_local = volumes.world_from_local
			Shining.shine(relight, case["light"], volumes.world_from_local.basis)
			var name := "relit %s atlas, %s" % [part["atlas"], case["name"]]
			relight.follow_now()
			_report(name + ", script", _by_script(part, atlas), case["irradiance"], case["tolerance"], "W/m^2")
			if not _headless():
				await Shining.updated(relight)
				_report(name + ", shader", await _by_shader(part, atlas, source), case["irradiance"], case["tolerance"], "W/m^2")
		relight.queue_free()
	_finish("the shader")
