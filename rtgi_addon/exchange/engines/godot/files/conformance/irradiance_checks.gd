extends "checks.gd"
## Irradiance from probes, by the look-up of volumes.gd and by that of irradiance.gdshaderinc.

const IRRADIANCE := """
	values[0] = rtgi_irradiance(texelFetch(table, ivec2(column, 0), 0).xyz, texelFetch(table, ivec2(column, 1), 0).xyz,
			texelFetch(table, ivec2(column, 2), 0).xyz);
"""


## At the points and under the normals of `where`.
func _by_script(where: Dictionary, volumes: RefCounted) -> Array:
	var found := []
	var basis: Basis = volumes.world_from_local.basis
	for row in where["points"].size():
		found.append(volumes.irradiance(volumes.world_from_local * _vector(where["points"][row]),
				basis * _vector(where["normals"][row]), basis * _vector(where["surface_normals"][row])))
	return found


func _by_shader(where: Dictionary, volumes: RefCounted, folder: String) -> Array:
	var columns := []
	var basis: Basis = volumes.world_from_local.basis
	for row in where["points"].size():
		columns.append([_colour(volumes.world_from_local * _vector(where["points"][row])), _colour(basis * _vector(where["normals"][row])),
				_colour(basis * _vector(where["surface_normals"][row]))])
	var material := _material(folder.path_join("irradiance.gdshaderinc"), 1, IRRADIANCE)
	volumes.apply_to(material)
	return (await _shown(material, _table(columns), 1)).map(func(values: Array) -> Vector3: return values[0])
