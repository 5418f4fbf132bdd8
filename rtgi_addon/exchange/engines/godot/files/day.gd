extends CanvasLayer
## Sliders of the sample for other light: the sun by the hour, the sky, and every group of lights.

## Noon's sun on a plane that faces it [W/m^2], and how red it is near the horizon.
const NOON := 3.0
const SUNSET := Color(1.0, 0.45, 0.15)
const LATITUDE := 50.0
const DAY := 172

@export var relight: NodePath = ^"../Relight"

## Solar time; below 0 the light stays as it was baked.
var hour := -1.0:
	set(value):
		hour = value
		_follow()
var _rows := {}

@onready var _relight: Node = get_node(relight)
@onready var _sun: DirectionalLight3D = $Sun
@onready var _panel: VBoxContainer = $Panel/Rows


func _ready() -> void:
	var german := OS.get_locale_language() == "de"
	_slider("hour", "Uhrzeit" if german else "Time of day", -0.5, 24.0, hour).value_changed.connect(func(value: float) -> void: hour = value)
	_slider("sun", "Sonne" if german else "Sun", 0.0, 3.0, 1.0).value_changed.connect(func(_value: float) -> void: _follow())
	# The probes are opened by then.
	await get_tree().process_frame
	for light: Dictionary in _relight.relit.lights:
		if light["kind"] != "suns":
			var text: String = ("Himmel" if german else "Sky") if light["kind"] == "world" else light["name"]
			_slider(light["name"], text, 0.0, 3.0, 1.0).value_changed.connect(func(_value: float) -> void: _follow())
	_follow()


func _slider(key: String, text: String, low: float, high: float, value: float) -> HSlider:
	var row := HBoxContainer.new()
	var label := Label.new()
	label.text = text
	label.custom_minimum_size.x = 140.0
	var slider := HSlider.new()
	slider.min_value = low
	slider.max_value = high
	slider.step = (high - low) / 490.0
	slider.custom_minimum_size = Vector2(240.0, 24.0)
	slider.value = value
	row.add_child(label)
	row.add_child(slider)
	_panel.add_child(row)
	_rows[key] = slider
	return slider


func _follow() -> void:
	if not is_node_ready():
		return
	var moved := hour >= 0.0
	var towards := sun_towards(hour)
	var day := smoothstep(-0.1, 0.17, towards.y)
	var power: float = NOON * smoothstep(0.0, 0.1, towards.y) * (_rows["sun"].value if _rows.has("sun") else 1.0)
	# A light's colour is given as a screen shows it.
	_sun.light_color = SUNSET.lerp(Color.WHITE, smoothstep(0.0, 0.4, towards.y)).linear_to_srgb()
	_sun.light_energy = power / PI
	_sun.visible = moved
	_sun.look_at_from_position(Vector3.ZERO, -towards, Vector3.UP if absf(towards.y) < 0.99 else Vector3.RIGHT)
	_relight.sun = _relight.get_path_to(_sun) if moved else ^""
	for lamp: DirectionalLight3D in get_parent().find_children("*", "DirectionalLight3D", true, false):
		if lamp != _sun:
			lamp.visible = not moved
	for light: Dictionary in _relight.relit.lights:
		if _rows.has(light["name"]):
			var strength: float = _rows[light["name"]].value
			_relight.factors[light["name"]] = strength * (0.02 + 0.98 * day if moved and light["kind"] == "world" else 1.0)


## Towards the sun at a solar time, below the horizon at night; north is -Z. As the sliders in Blender have it: right to a degree.
static func sun_towards(at: float) -> Vector3:
	var declination := asin(sin(deg_to_rad(23.44)) * sin(TAU * (DAY - 80.0) / 365.0))
	var angle := (at - 12.0) * PI / 12.0
	var north := deg_to_rad(LATITUDE)
	return Vector3(-cos(declination) * sin(angle), sin(declination) * sin(north) + cos(declination) * cos(angle) * cos(north),
			-(sin(declination) * cos(north) - cos(declination) * cos(angle) * sin(north)))
