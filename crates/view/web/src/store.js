// State of the page, with listeners.

export class Store {
  constructor(state) {
    this.state = state;
    this.listeners = [];
  }

  /** Changes the state; listeners get the new state and the names of what changed. */
  set(patch) {
    const changed = Object.keys(patch).filter((key) => this.state[key] !== patch[key]);
    if (!changed.length) return;
    Object.assign(this.state, patch);
    for (const listener of this.listeners) listener(this.state, changed);
  }

  listen(listener) {
    this.listeners.push(listener);
  }
}

/** State of a page that was just opened. */
export const initial = {
  time: 0,
  playing: false,
  pace: 1,
  loop: true,
  colour: "grain",
  quantity: "speed",
  slice: true,
  plane: 0,
  arrows: false,
  paths: true,
  box: true,
  follow: null,
  picked: null,
  atEnd: false,
  help: false,
};
