extends "irradiance_checks.gd"
## Holds probes under other light to `rtgi relight`: the arithmetic of relit.gd on the imported tables, and relight.gdshader on the GPU.

const Shining := preload("shining.gd")


func _initialize() -> void:
	var expected := _expected("relight.json")
	if expected.is_empty():
		return
	var volumes_library: GDScript = load(_folder.path_join("../rtgi/volumes.gd").simplify_path())
	var relight_library: GDScript = load(_folder.path_join("../rtgi/relight.gd").simplify_path())
	for part: Dictionary in expected["sets"]:
		var source: String = _sources()[part["volumes"]]
		var volumes: RefCounted = volumes_library.new()
		var relight: Node = relight_library.new()
		relight.parts = 3
		relight.follow_in_scripts = false
		relight.every_frame = false
		root.add_child(relight)
		if volumes.open(source) != OK or relight.set_up(volumes, source) != OK:
			printerr("FAIL the transfer of %s cannot be read: run godot --headless --path . --import first" % source)
			quit(1)
			return
		for number in part["cases"].size():
			var case: Dictionary = part["cases"][number]
			# Every other lighting with the probes elsewhere.
			volumes.world_from_local = MOVED if number % 2 else Transform3D.IDENTITY
			Shining.shine(relight, case["light"], volumes.world_from_local.basis)
			var name := "relit %s, %s" % [part["volumes"], case["name"]]
			relight.follow_now()
			_report(name + ", script", _by_script(part, volumes), case["irradiance"], case["tolerance"], "W/m^2")
			if not _headless():
				await Shining.updated(relight)
				_report(name + ", shader", await _by_shader(part, volumes, source), case["irradiance"], case["tolerance"], "W/m^2")
		relight.queue_free()
	_finish("the shader")
