// Holds relighting to `rtgi relight`: every lighting of relight.json on the probes that it names, by `ask(probes, relight, case)`,
// which brings irradiance at the set's points.

import { Color, Vector3 } from 'three';
import { RTGIRelight } from '../rtgi/RTGIRelight.js';
import { compare } from './compare.js';

export async function checkRelight(read, probes, ask) {
  const { sets } = await read('relight.json', 'json');
  const results = [];
  for (const { volumes, cases, ...asked } of sets) {
    const folder = volumes === 'kit' ? '' : '../rtgi/';
    const description = await read(`${folder}${volumes === 'kit' ? 'kit_transfer' : 'transfer'}.json`, 'json');
    const relight = new RTGIRelight(description, await read(folder + description.data.file, 'arraybuffer'), probes[volumes]);
    for (const { name, light, irradiance, tolerance } of cases) {
      relight.suns = light.suns?.map((sun) => ({ towards: new Vector3(...sun.towards), irradiance: new Color(...sun.irradiance) }));
      relight.suns ??= null;
      relight.sky = light.sky;
      relight.factors = light.factors;
      results.push(compare(`relit ${volumes}, ${name}`, { ...asked, irradiance, tolerance },
        await ask(probes[volumes], relight, asked)));
    }
    relight.dispose();
  }
  return results;
}
