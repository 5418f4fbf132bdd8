// Holds the light atlas under other light to RTGI's own numbers: every lighting of atlas_relight.json, followed by RTGIRelight on the
// probes beside it, and asked by `ask(atlas, asked)`, which brings irradiance at the set's places.

import { Color, Vector3 } from 'three';
import { RTGIAtlas } from '../rtgi/RTGIAtlas.js';
import { RTGIRelight } from '../rtgi/RTGIRelight.js';
import { compare } from './compare.js';

export async function checkAtlasRelight(read, probes, ask, renderer = null) {
  const results = [];
  for (const { atlas: name, cases, ...asked } of (await read('atlas_relight.json', 'json')).sets) {
    const [folder, stem] = name === 'kit' ? ['', 'kit_'] : ['../rtgi/', ''];
    const bytes = (file) => read(folder + file, 'arraybuffer');
    const [sheet, tables] = await Promise.all(['atlas', 'transfer'].map((file) => read(`${folder}${stem}${file}.json`, 'json')));
    const atlas = new RTGIAtlas(sheet, await bytes(sheet.data.file), await bytes(sheet.transfer.data.file));
    const relight = new RTGIRelight(tables, await bytes(tables.data.file), probes[name].addAtlas(atlas));
    for (const { name: lighting, light, ...expected } of cases) {
      relight.suns = light.suns?.map((sun) => ({ towards: new Vector3(...sun.towards), irradiance: new Color(...sun.irradiance) }))
        ?? null;
      relight.sky = light.sky;
      relight.factors = light.factors;
      relight.finish(renderer);
      results.push(compare(`relit ${name} atlas, ${lighting}`, expected, await ask(atlas, { ...asked, ...expected })));
    }
    relight.dispose();
    atlas.dispose();
    probes[name].addAtlas(null);
  }
  return results;
}
