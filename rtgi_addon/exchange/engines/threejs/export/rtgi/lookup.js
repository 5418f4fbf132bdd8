// What the probes say about a point on a surface, on the CPU: the twin of shader.js, in plain numbers and without three.
//
// A surface has two normals: the one that is shaded, with bumps and normal maps, belongs to the cosine of irradiance; its own, n
// below, says which probes are behind it and where it must be seen from.
//
// Eight neighbours, weighted by what they can know of the point: trilinear x ((n.d + 1) / 2)^2 + 0.2 (d towards the probe: probes
// behind the surface count little) x the square of the share of what the probe saw in that direction that lies beyond the point, from
// mean and variance of the distances stored; weights below 0.2 are crushed to w^3 / 0.2^2. Probes inside geometry weigh nothing.
// After Z. Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019.

export const COEFFICIENTS = 9;

// The numbers of weights.js, for this file and RTGIProbeLight.js.
export const SIDE_FLOOR = 0.2;
export const CRUSH_BELOW = 0.2;
export const UNSEEN_FLOOR = 1e-6;
export const DILATED_FLOOR = 1e-12;
export const LIFT = 0.2;
export const AT_PROBE = 1e-6;
export const TINY = 1.17549435e-38;
export const WORD = 256;
export const SHARES = 255;
export const COSINE_0 = 0.886226925;
export const COSINE_1 = 1.02332671;
export const COSINE_2 = 0.858085531;
export const COSINE_2_ZONAL = 0.247707956;

// The real orthonormal harmonics 1, y, z, x, xy, yz, 3z^2 - 1, xz, x^2 - y^2 at the unit direction (x, y, z).
export function harmonics(x, y, z, target = new Array(COEFFICIENTS)) {
  target[0] = 0.28209479177387814;
  target[1] = 0.4886025119029199 * y;
  target[2] = 0.4886025119029199 * z;
  target[3] = 0.4886025119029199 * x;
  target[4] = 1.0925484305920792 * x * y;
  target[5] = 1.0925484305920792 * y * z;
  target[6] = 0.31539156525252005 * (3 * z * z - 1);
  target[7] = 1.0925484305920792 * x * z;
  target[8] = 0.5462742152960396 * (x * x - y * y);
  return target;
}

// The same, each times its band of the cosine lobe (Ramamoorthi and Hanrahan 2001): irradiance from radiance.
function cosineBasis(x, y, z) {
  return [COSINE_0, COSINE_1 * y, COSINE_1 * z, COSINE_1 * x, COSINE_2 * x * y, COSINE_2 * y * z, COSINE_2_ZONAL * (3 * z * z - 1),
    COSINE_2 * x * z, 0.5 * COSINE_2 * (x + y) * (x - y)];
}

// How surely a probe sees a point at that distance, where its tile has that mean and mean square: the share beyond it, squared.
function seenShare(distance, mean, square) {
  const behind = distance - mean;
  const variance = Math.abs(square - mean * mean);
  return (0.5 - 0.5 * behind / Math.sqrt(Math.max(variance + behind * behind, TINY))) ** 2;
}

function sideWeight(towards, normal) {
  const distance = Math.hypot(...towards);
  const cosine = distance > 0 ? (towards[0] * normal[0] + towards[1] * normal[1] + towards[2] * normal[2]) / distance : 1;
  return (0.5 * (cosine + 1)) ** 2 + SIDE_FLOOR;
}

function probeWeight(trilinear, seen, live) {
  const crushed = seen < CRUSH_BELOW ? seen ** 3 / CRUSH_BELOW ** 2 : seen;
  return trilinear * ((live ? crushed + UNSEEN_FLOOR : 0) + DILATED_FLOOR);
}

// m (4x4, column by column) times the point or, with w = 0, the vector (x, y, z).
function transform(m, x, y, z, w = 1) {
  return [m[0] * x + m[4] * y + m[8] * z + m[12] * w, m[1] * x + m[5] * y + m[9] * z + m[13] * w,
    m[2] * x + m[6] * y + m[10] * z + m[14] * w];
}

const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

// Square coordinates from -1 to 1 of a direction. Tiles keep Blender's axes: its y is -z here, and its z is y.
function octahedral(x, y, z) {
  const sum = Math.abs(x) + Math.abs(y) + Math.abs(z);
  const u = x / sum, v = -z / sum;
  if (y >= 0) {
    return [u, v];
  }
  return [(1 - Math.abs(v)) * (u < 0 ? -1 : 1), (1 - Math.abs(u)) * (v < 0 ? -1 : 1)];
}

// Probes ready for reading: `volumes` as RTGIProbeLoader prepares them, finest cells first; `probes` (Float32Array) nine texels of
// four a probe; `distances` (Uint16Array) the bordered tiles of (mean, deviation) of a texel and of the next one in its row; `words`
// (Float32Array) what the nodes of scattered volumes name, four each.
export class ProbeLookup {
  constructor(volumes, probes, distances, words = []) {
    this.words = words;
    this.volumes = volumes;
    this.probes = probes;
    this.distances = distances;
  }

  // Irradiance [W/m2] at `point` with unit `normal` on a surface with unit `surfaceNormal` ([x, y, z] each, the probes' space), never
  // negative, into `target` (r, g, b).
  irradiance(point, normal, surfaceNormal = normal, target = [0, 0, 0]) {
    const basis = cosineBasis(...normal);
    target.fill(0);
    for (const [volume, share] of this.shares(point)) {
      const coefficients = this._blended(volume, point, surfaceNormal);
      for (let channel = 0; channel < 3; channel++) {
        let sum = 0;
        for (let i = 0; i < COEFFICIENTS; i++) {
          sum += basis[i] * coefficients[3 * i + channel];
        }
        target[channel] += share * Math.max(sum, 0);
      }
    }
    return target;
  }

  // Coefficients of the radiance that arrives at `point` (27 numbers, r, g, b of each), for objects without one normal there.
  radiance(point, target = new Float64Array(3 * COEFFICIENTS)) {
    target.fill(0);
    for (const [volume, share] of this.shares(point)) {
      this._blended(volume, point, null).forEach((value, i) => { target[i] += share * value; });
    }
    return target;
  }

  // The volumes that light `point`, with shares that add up to 1: the finest first, blended into the next over its outermost
  // cell; outside all of them the nearest one.
  shares(point) {
    const found = [];
    let left = 1, total = 0, nearest = null, nearestDistance = Infinity;
    for (const volume of this.volumes) {
      const offset = point.map((value, axis) => value - volume.centre[axis]);
      const lattice = transform(volume.latticeFromOffset, ...offset);
      let covered = 1;
      const outside = [0, 0, 0];
      for (let axis = 0; axis < 3; axis++) {
        const count = volume.resolution[axis];
        covered = Math.min(covered, Math.min(lattice[axis] + 0.5, count - 0.5 - lattice[axis]) / Math.min(0.5 * count, 1));
        outside[axis] = clamp(lattice[axis], -0.5, count - 0.5) - lattice[axis];
      }
      covered = Math.max(covered, 0);
      if (left * covered > 0) {
        found.push([volume, left * covered]);
      }
      total += left * covered;
      left *= 1 - covered;
      const distance = Math.hypot(...transform(volume.offsetFromLattice, ...outside, 0));
      if (distance < nearestDistance) {
        [nearest, nearestDistance] = [volume, distance];
      }
    }
    return total > 0 ? found.map(([volume, share]) => [volume, share / total]) : [[nearest, 1]];
  }

  // The probe at `index` of the flat lattice of `volume`: its place from the volume's centre, and whether it holds light.
  probe(volume, index) {
    const [nx, ny] = volume.resolution;
    // Places of scattered probes count from the centre.
    const place = volume.probes === undefined
      ? transform(volume.offsetFromLattice, index % nx, Math.floor(index / nx) % ny, Math.floor(index / (nx * ny))) : [0, 0, 0];
    const first = 4 * COEFFICIENTS * (volume.firstProbe + index);
    return { place: place.map((value, axis) => value + this.probes[first + 4 * axis + 3]), live: this.probes[first + 15] !== 0 };
  }

  // The coefficients (27) that the eight probes around `point` agree on, with the surface's own normal there. Without a normal only
  // what they see weighs them.
  _blended(volume, point, normal) {
    const offset = point.map((value, axis) => value - volume.centre[axis]);
    const biased = normal ? offset.map((value, axis) => value + volume.normalBias * normal[axis]) : offset;
    const low = [], fraction = [];
    const lifted = normal ? offset.map((value, axis) => value + LIFT * volume.normalBias * normal[axis]) : offset;
    transform(volume.latticeFromOffset, ...lifted).forEach((value, axis) => {
      const last = volume.resolution[axis] - 1, position = clamp(value, 0, last);
      low[axis] = Math.min(Math.floor(position), Math.max(last - 1, 0));
      fraction[axis] = position - low[axis];
    });
    const sum = new Float64Array(3 * COEFFICIENTS);
    let total = 0;
    for (let corner = 0; corner < 8; corner++) {
      let trilinear = 1, index = 0;
      for (let axis = 2; axis >= 0; axis--) {
        const step = corner >> axis & 1, count = volume.resolution[axis];
        trilinear *= step ? fraction[axis] : 1 - fraction[axis];
        index = index * count + Math.min(low[axis] + step, count - 1);
      }
      if (trilinear === 0) {
        continue;
      }
      for (const [probe, share, meant] of this._named(volume, index)) {
        const { place, live } = this.probe(volume, probe);
        let seen = this._visibility(volume, probe, biased.map((value, axis) => value - place[axis]));
        if (normal) {
          seen *= sideWeight(place.map((value, axis) => value - offset[axis]), normal);
        }
        const weight = probeWeight(trilinear * share, seen, meant && live);
        total += weight;
        const first = 4 * COEFFICIENTS * (volume.firstProbe + probe);
        for (let i = 0; i < COEFFICIENTS; i++) {
          for (let channel = 0; channel < 3; channel++) {
            sum[3 * i + channel] += weight * this.probes[first + 4 * i + channel];
          }
        }
      }
    }
    return sum.map((value) => value / total);
  }

  // What a node names: of each probe its index, its share, and whether it is meant and does not stand in for others.
  _named(volume, node) {
    if (volume.probes === undefined) {
      return [[node, 1, true]];
    }
    const first = 4 * (volume.firstNode + node);
    return Array.from(this.words.slice(first, first + 4)).filter((word) => word !== 0)
      .map((word) => [Math.floor(Math.abs(word) / WORD), Math.abs(word) % WORD / SHARES, word > 0]);
  }

  // How surely the probe sees the point at `offset` from it.
  _visibility(volume, index, offset) {
    const distance = Math.hypot(...offset), tile = volume.tile;
    const [u, v] = distance <= AT_PROBE * volume.normalBias ? [0, 0] : octahedral(...offset);
    const x = (u + 1) * 0.5 * tile + 0.5, y = (v + 1) * 0.5 * tile + 0.5;
    const column = clamp(Math.floor(x), 0, tile), row = clamp(Math.floor(y), 0, tile);
    const fx = x - column, fy = y - row;
    let mean = 0, square = 0;
    for (const [step, share] of [[0, 1 - fy], [1, fy]]) {
      const texel = 4 * (volume.firstTexel + (index * (tile + 2) + row + step) * (tile + 1) + column);
      for (const [next, along] of [[0, 1 - fx], [2, fx]]) {
        const m = volume.distanceStep * this.distances[texel + next], s = volume.distanceStep * this.distances[texel + next + 1];
        mean += share * along * m;
        square += share * along * (m * m + s * s);
      }
    }
    return seenShare(distance, mean, square);
  }
}
