// Cones through lit voxels on the CPU: what the shader in the voxels' .json does, for scripts.

const FAR = 1e30, AXES = [0, 1, 2];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const along = (start, direction, at) => AXES.map((axis) => start[axis] + direction[axis] * at);
// Share of light that an optical depth takes.
const taken = (depth) => (depth < 1e-3 ? depth * (1 - 0.5 * depth) : 1 - Math.exp(-depth));

// Direction `local` about +z turned to lie about `normal` (Duff 2017).
export function about([x, y, z], local) {
  const sign = z < 0 ? -1 : 1, a = -1 / (sign + z), b = x * y * a;
  const tangent = [1 + sign * x * x * a, sign * b, -sign * x], bitangent = [b, sign + y * y * a, -y];
  return AXES.map((axis) => tangent[axis] * local[0] + bitangent[axis] * local[1] + [x, y, z][axis] * local[2]);
}

export class VoxelLookup {
  // `lookup` of the description, and the three lists as numbers, one after the other.
  constructor(lookup, rows, cells, light) {
    Object.assign(this, lookup, { rows, cells, light });
  }

  // Irradiance [r, g, b] at a place in the finest cells under a unit normal of the voxels' own axes.
  irradiance(start, normal) {
    const sum = [0, 0, 0];
    for (const cone of this.cones) {
      const seen = this.seen(start, about(normal, cone), normal, this.spread);
      AXES.forEach((channel) => { sum[channel] += Math.PI * cone[3] * seen[channel]; });
    }
    return sum;
  }

  // What one cone sees, sky and all; `normal` is null where it leaves no surface.
  seen(start, direction, normal, spread) {
    const sum = [0, 0, 0];
    let left = 1;
    for (let grid = 0; grid < this.grids && left > 0; grid++) {
      const here = this.place(0, grid, start), share = grid === this.grids - 1 ? left : left * (1 - this.outside(grid, here));
      left -= share;
      if (share > 0) {
        const { radiance, passed } = this.cone({ grid, start: here, direction, normal }, spread);
        const sky = passed > 0 ? this.skyTowards(direction) : [0, 0, 0];
        AXES.forEach((channel) => { sum[channel] += share * (radiance[channel] + passed * sky[channel]); });
      }
    }
    return sum;
  }

  // Radiance of the smooth sky: SH of order 2.
  skyTowards([x, y, z]) {
    const basis = [0.28209479, 0.48860251 * y, 0.48860251 * z, 0.48860251 * x, 1.09254843 * x * y, 1.09254843 * y * z,
      0.31539157 * (3 * z * z - 1), 1.09254843 * x * z, 0.54627422 * (x * x - y * y)];
    return AXES.map((channel) => Math.max(0, basis.reduce((sum, value, index) => sum + value * this.sky[index][channel], 0)));
  }

  // What a cone sees that is 2·spread as wide as it is long.
  cone(ray, spread) {
    const { grid, start, direction, normal } = ray, { step, numbers } = this, last = this.grids - 1, scale = 2 ** (last - grid);
    let clear = FAR, reach = this.near;
    if (normal) {
      clear = dot(direction, normal) / (numbers.CONE_SUPPORT * (Math.abs(normal[0]) + Math.abs(normal[1]) + Math.abs(normal[2])));
      reach = Math.max(reach, 1 / Math.max(clear, 1e-6));
    }
    const seen = this.march(ray, reach);
    const [enter, out] = this.span(last, this.place(grid, last, start), direction).map((end) => end * scale);
    const leave = out + Math.min(Math.max(spread * out, 1), clear * Math.max(out, 0) + 1), top = this.levels.length - 1 - grid;
    let at = Math.max(enter, seen.at), sheet = 1, level = 0;
    while (at < leave - 1e-5 && seen.passed > numbers.VOXEL_SPENT) {
      let lod = Math.log2(Math.max(spread * at, 1));
      lod = Math.min(lod, Math.floor(Math.log2(Math.max(clear * at, 1))), top);
      level = Math.max(this.narrow(ray, at, sheet < 1 ? level : lod), this.least(grid, along(start, direction, at)));
      const way = Math.min(step * 2 ** level, leave - at), middle = along(start, direction, at + 0.5 * way);
      const lower = Math.min(Math.floor(level), top), blend = level - lower;
      const met = { depth: 0, glow: [0, 0, 0], share: 0, shown: [0, 0, 0] };
      this.add(grid, grid + lower, middle, direction, 1 - blend, met);
      if (blend > 0 && lower < top) {
        this.add(grid, grid + lower + 1, middle, direction, blend, met);
      }
      // Shares of one sheet add up, all else multiplies.
      const crossed = numbers.CONE_TIGHT * met.share * way, cut = Math.min(crossed / Math.max(sheet, 1e-6), 1);
      sheet = crossed > 0 ? sheet - crossed : 1;
      const rest = taken(met.depth * way);
      const ofSheet = met.share > 0 ? cut * (1 - 0.5 * rest) / met.share : 0;
      const ofRest = met.depth > 0 ? rest * (1 - 0.5 * cut) / met.depth : 0;
      AXES.forEach((channel) => {
        seen.radiance[channel] += seen.passed * (ofSheet * met.shown[channel] + ofRest * met.glow[channel]);
      });
      seen.passed *= (1 - rest) * (1 - cut);
      at += way;
    }
    seen.passed = seen.passed <= numbers.VOXEL_SPENT ? 0 : seen.passed;
    return seen;
  }

  // `lod`, or the largest whole number below it for which no level that the next sample lies between has cells that are too wide.
  narrow({ grid, start, direction }, at, lod) {
    for (let over = Math.min(Math.ceil(lod), this.levels.length - 1 - grid); over > 0; over--) {
      if (lod > over - 1) {
        const { low } = this.sample(grid, grid + over, along(start, direction, at + 0.5 * this.step * 2 ** lod));
        const half = 2 * this.number(grid + over, ...low);
        lod = half - Math.floor(half) > 0.25 ? over - 1 : lod;
      }
    }
    return lod;
  }

  // The least level that may answer at a place: where it is beyond a grid, the next one, and between two where both do.
  least(grid, position) {
    let least = 0;
    for (let over = 0; grid + over < this.grids - 1 && least === over; over++) {
      least += this.outside(grid + over, this.place(grid, grid + over, position));
    }
    return least;
  }

  // The lowest of the eight cells that a sample lies between, and how far it is on the way from its centre.
  sample(grid, level, position) {
    const shape = this.levels[level], place = this.place(grid, level, position).map((value, axis) =>
      clamp(value + 0.5, 0, shape[axis] - 1));
    const low = place.map((value, axis) => Math.min(Math.floor(value), shape[axis] - 2));
    return { low, part: place.map((value, axis) => value - low[axis]) };
  }

  // Add a level's trilinear sample.
  add(grid, level, position, direction, weight, met) {
    const { low, part } = this.sample(grid, level, position);
    if (this.number(level, ...low) === 0) {
      return;
    }
    for (let corner = 0; corner < 8; corner++) {
      const up = [corner & 1, corner >> 1 & 1, corner >> 2];
      const share = up.reduce((product, high, axis) => product * (high ? part[axis] : 1 - part[axis]), weight / 2 ** (level - grid));
      const row = share > 0 ? Math.floor(this.number(level, low[0] + up[0], low[1] + up[1], low[2] + up[2])) : 0;
      if (row === 0) {
        continue;
      }
      const cell = 12 * row, way = direction.map((value) => value * share), crossed = way.map(Math.abs);
      let adds = this.cells[cell + 3] !== 0;
      if (adds && level < this.grids) {
        // A grid's own cells add for those who are in a finer one, and add what they block.
        adds = level > grid;
        AXES.forEach((axis) => {
          const depth = this.cells[cell + axis];
          crossed[axis] *= adds && depth > 0 ? taken(depth) / depth : 1;
        });
      }
      const depth = dot(this.cells.subarray(cell, cell + 3), crossed), glow = this.glow(row, direction, crossed);
      met[adds ? 'share' : 'depth'] += depth;
      AXES.forEach((channel) => { met[adds ? 'shown' : 'glow'][channel] += glow[channel]; });
      const through = dot(this.cells.subarray(cell + 4, cell + 7), way);
      if (!adds && through !== 0) {
        met.share += Math.abs(through);
        AXES.forEach((channel) => { met.shown[channel] += Math.abs(through) * this.shown(row, through, channel); });
      }
    }
  }

  // Cell by cell until the ray leaves its grid, or comes to an empty cell after `reach`.
  march(ray, reach) {
    const { grid, start, direction } = ray, seen = { radiance: [0, 0, 0], passed: 1, at: 0 };
    const [enter, leave] = this.span(grid, start, direction), last = this.levels[grid].slice(0, 3).map((count) => count - 3);
    seen.at = enter;
    if (leave <= enter) {
      return seen;
    }
    const step = direction.map((value) => (value < 0 ? -1 : 1)), cell = along(start, direction, enter).map((place, axis) => {
      const number = clamp(Math.floor(place), 0, last[axis]);
      // A ray that starts between two cells is in the one that it goes to.
      return number - (step[axis] < 0 && place === number && number > 0 ? 1 : 0);
    });
    const row = () => Math.floor(this.number(grid, cell[0] + 1, cell[1] + 1, cell[2] + 1));
    for (let count = last[0] + last[1] + last[2] + 3; count > 0; count--) {
      const ahead = AXES.map((axis) =>
        (direction[axis] === 0 ? FAR : (cell[axis] + Math.max(step[axis], 0) - start[axis]) / direction[axis]));
      const axis = ahead[0] <= ahead[1] && ahead[0] <= ahead[2] ? 0 : (ahead[1] <= ahead[2] ? 1 : 2);
      const end = Math.min(ahead[axis], leave), here = row();
      if (here > 0) {
        const { blocked, shown } = this.met(ray, here, start.map((value, i) => value - cell[i] - 0.5), seen.at, end);
        AXES.forEach((channel) => { seen.radiance[channel] += seen.passed * shown[channel]; });
        seen.passed *= 1 - blocked;
      }
      seen.at = end;
      cell[axis] += step[axis];
      if (end >= leave || seen.passed <= this.numbers.VOXEL_SPENT || (end >= reach && row() === 0)) {
        break;
      }
    }
    seen.passed = seen.passed <= this.numbers.VOXEL_SPENT ? 0 : seen.passed;
    return seen;
  }

  // What a voxel takes and shows on the part of a ray from `at` to `end`; `from` is where the ray starts from its centre.
  met({ direction, normal }, row, from, at, end) {
    const { numbers } = this, cell = 12 * row, filled = this.cells[cell + 7], plane = this.cells.subarray(cell + 8, cell + 11);
    const way = direction.map((value) => value * Math.max(end - at, 0)), crossed = way.map(Math.abs), begin = along(from, direction, at);
    const before = dot(plane, begin) - this.cells[cell + 11], through = dot(plane, way), after = before + through;
    const near = Math.min(before, after) < numbers.VOXEL_GAP && Math.max(before, after) > -numbers.VOXEL_GAP;
    let cut = near ? Math.max(filled, 0) : 0;
    if (filled < 0) {
      // What lies across an axis is met where it lies, and not on the way there.
      AXES.filter((axis) => plane[axis] < numbers.VOXEL_NO_PLATE).forEach((axis) => {
        const first = begin[axis] - plane[axis], second = first + way[axis];
        crossed[axis] = Math.min(first, second) < numbers.VOXEL_PLATE && Math.max(first, second) > -numbers.VOXEL_PLATE ? 1 : 0;
      });
    }
    if (normal) {
      const own = normal.map(Math.abs);
      if (Math.abs(dot(from, normal)) <= 0.5 * (own[0] + own[1] + own[2]) + numbers.VOXEL_TOUCHING) {
        AXES.filter((axis) => own[axis] > numbers.VOXEL_OWN_AXIS).forEach((axis) => { crossed[axis] = 0; });
        cut = Math.abs(dot(plane, normal)) > numbers.VOXEL_OWN_PLANE ? 0 : cut;
      }
    }
    const depth = dot(this.cells.subarray(cell, cell + 3), crossed), blocked = taken(depth);
    const glow = this.glow(row, direction, crossed), share = depth > 0 ? blocked / depth : 0;
    return { blocked: blocked + cut, shown: AXES.map((channel) =>
      share * glow[channel] + (cut > 0 ? cut * this.shown(row, through, channel) : 0)) };
  }

  // Optical depth times what the faces show that `direction` looks at, by how much of each axis is crossed.
  glow(row, direction, crossed) {
    return AXES.map((channel) => AXES.reduce((sum, axis) =>
      sum + crossed[axis] * this.light[4 * (8 * row + 2 * axis + (direction[axis] < 0 ? 1 : 0)) + channel], 0));
  }

  // Radiance of a sheet's side.
  shown(row, through, channel) {
    return this.light[4 * (8 * row + (through > 0 ? 7 : 6)) + channel];
  }

  // The row in the lists of a cell, whose array begins with an empty layer, and the half and the quarter beside it (see the shader).
  number(level, x, y, z) {
    const [nx, ny, nz, first] = this.levels[level];
    return x < 0 || y < 0 || z < 0 || x >= nx || y >= ny || z >= nz ? 0 : this.rows[first + (z * ny + y) * nx + x];
  }

  // Where a place in the cells of a grid lies in those of a level that is no finer.
  place(grid, level, position) {
    return position.map((value, axis) =>
      value / 2 ** (level - grid) - (this.origins[level][axis] - this.origins[grid][axis]) / 2 ** level);
  }

  // How far a place in the cells of a grid is on the way out of it: 0 within, 1 where the next one answers alone.
  outside(grid, place) {
    const inward = Math.min(...place.map((value, axis) => Math.min(value, this.levels[grid][axis] - 2 - value)));
    return clamp((this.numbers.VOXEL_EDGE + this.numbers.VOXEL_BLEND - inward) / this.numbers.VOXEL_BLEND, 0, 1);
  }

  // Where a ray enters and leaves a grid; it begins at 0.
  span(grid, start, direction) {
    let enter = 0, leave = FAR;
    AXES.forEach((axis) => {
      const high = this.levels[grid][axis] - 2;
      if (direction[axis] === 0) {
        // Between the planes all the way, or nowhere.
        [enter, leave] = start[axis] >= 0 && start[axis] < high ? [enter, leave] : [FAR, -FAR];
        return;
      }
      const ends = [-start[axis] / direction[axis], (high - start[axis]) / direction[axis]];
      enter = Math.max(enter, Math.min(...ends));
      leave = Math.min(leave, Math.max(...ends));
    });
    return [enter, leave];
  }
}
