extends RefCounted
## Other light on a node with relight.gd, as the kit's lightings have it.


static func shine(relight: Node, light: Dictionary, basis: Basis) -> void:
	relight.suns = null
	if light["suns"] != null:
		relight.suns = light["suns"].map(func(sun: Dictionary) -> Dictionary:
			return {"towards": basis * _vector(sun["towards"]), "irradiance": _vector(sun["irradiance"])})
	relight.sky = light["sky"]
	relight.factors = {}
	for name: String in light["factors"]:
		relight.factors[name] = _vector(light["factors"][name])


## In parts, as a game would; pictures are drawn at the end of a frame.
static func updated(relight: Node) -> void:
	while true:
		var done: bool = relight.update()
		await RenderingServer.frame_post_draw
		if done:
			return


static func _vector(row: Array) -> Vector3:
	return Vector3(row[0], row[1], row[2])
