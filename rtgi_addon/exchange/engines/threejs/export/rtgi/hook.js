// How materials come to be compiled with more than three.js gives them, and are given back as they were.

const HOOKS = ['onBeforeCompile', 'customProgramCacheKey'];

// The hooks of one kind: a material is one owner's at most.
export class Hooks {
  constructor() {
    this._hooked = new WeakMap();
    this._materials = new WeakMap();
  }

  // Have `splice(shader, renderer)` change what `material` is compiled from, after its own hooks, for `owner`, and take it from the
  // owner it was. Materials of equal settings share a program: `name()` tells what is done to it.
  add(owner, material, splice, name) {
    const earlier = this._hooked.get(material);
    if (earlier?.owner === owner) {
      return;
    }
    this.remove(earlier?.owner, material);
    const { onBeforeCompile, customProgramCacheKey } = material;
    // Own hooks of the material come back when it is released; else those of its class do.
    const own = HOOKS.filter((key) => Object.hasOwn(material, key)).map((key) => [key, material[key]]);
    // three's own key is the text of onBeforeCompile, which here would be ours.
    const key = Object.hasOwn(material, 'customProgramCacheKey')
      ? () => customProgramCacheKey.call(material) : () => onBeforeCompile.toString();
    this._hooked.set(material, { owner, own });
    this._of(owner).add(material);
    material.onBeforeCompile = (shader, renderer) => {
      onBeforeCompile.call(material, shader, renderer);
      splice(shader, renderer);
    };
    material.customProgramCacheKey = () => `${name()} ${key()}`;
    material.needsUpdate = true;
  }

  // Give `material` back, if it is the owner's.
  remove(owner, material) {
    const hook = this._hooked.get(material);
    if (!hook || hook.owner !== owner) {
      return;
    }
    HOOKS.forEach((key) => delete material[key]);
    Object.assign(material, Object.fromEntries(hook.own));
    this._hooked.delete(material);
    this._of(owner).delete(material);
    material.needsUpdate = true;
  }

  // Give all materials of the owner back.
  clear(owner) {
    [...this._of(owner)].forEach((material) => this.remove(owner, material));
  }

  _of(owner) {
    if (!this._materials.has(owner)) {
      this._materials.set(owner, new Set());
    }
    return this._materials.get(owner);
  }
}
