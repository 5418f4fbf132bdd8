// What both conformance scripts share: the kit's files, and what counts as equal.

// The probes that cases ask about and the cases: `read(name, type)` brings the content of a file of this folder, as 'json' or as
// 'arraybuffer'.
export async function readKit(loader, read) {
  const { cases, lightProbe, spheres, atlas, relitAtlas } = await read('conformance.json', 'json');
  const probes = {};
  for (const [name, file] of [['kit', 'kit.json'], ['bundle', '../rtgi/probes.json']]) {
    const description = await read(file, 'json');
    const folder = file.slice(0, file.lastIndexOf('/') + 1);
    probes[name] = loader.parse(description, await read(folder + description.data.file, 'arraybuffer'));
  }
  return { cases, lightProbe, probes, spheres, atlas, relitAtlas };
}

// How far `found` ([r, g, b] for every point) is from what the case expects, in shares of what half floats may lose. `slack` widens
// that for a target or a unit of less than float's precision.
export function compare(label, expected, found, slack = 1) {
  let worst = -1, at = 0, error = 0, brightest = 0;
  expected.irradiance.forEach((irradiance, point) => irradiance.forEach((value, channel) => {
    const difference = Math.abs(found[point][channel] - value);
    // NaN is worse than anything; nothing may be asked for nothing.
    const share = difference === 0 ? 0 : difference / (slack * expected.tolerance[point][channel]) || Infinity;
    error = Math.max(error, difference);
    brightest = Math.max(brightest, value);
    if (share > worst) {
      [worst, at] = [share, point];
    }
  }));
  const passed = worst <= 1;
  const numbers = (row) => `(${row.map((value) => value.toPrecision(6)).join(', ')})`;
  const text = `${passed ? 'pass' : 'FAIL'}  ${label}: ${expected.irradiance.length} points, worst difference ` +
    `${error.toExponential(1)} W/m2 of ${brightest.toPrecision(3)}, ${(100 * worst).toFixed(0)} % of the tolerance` +
    (passed ? '' : ` at point ${at}: ${numbers(found[at])} instead of ${numbers(expected.irradiance[at])}`);
  return { label, passed, worst, error, text };
}

// As `compare`, of media: `found` are two colours for every point, extinction and source or transmittance and radiance.
export function compareMedia(expected, found) {
  const results = ['first', 'second'].map((key, which) => compare(`${expected.name}, ${key}`,
    { irradiance: expected[key], tolerance: expected[`${key}_tolerance`] }, found.map((pair) => pair[which])));
  return results[0].worst > results[1].worst ? results[0] : results[1];
}

// The last line, for a person and for a program that reads it.
export function summary(results) {
  const failed = results.filter((result) => !result.passed).length;
  return failed ? `FAILED: ${failed} of ${results.length} comparisons` : `PASSED: all ${results.length} comparisons`;
}
