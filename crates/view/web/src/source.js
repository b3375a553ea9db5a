// Where the data comes from: blocks of a saved page, or the server.

import { unpackAll } from "./packed.js";

const block = (id) => document.getElementById(id);

async function read(id, path) {
  if (block(id)) return JSON.parse(block(id).textContent);
  const answer = await fetch(path, { cache: "no-store" });
  if (!answer.ok) throw new Error((await answer.text()).trim() || `${path}: ${answer.status}`);
  return answer.json();
}

/** Reads the list of runs. */
export async function readIndex() {
  return unpackAll(await read("index", "/index.json"));
}

/** Reads a run. The codes of its slices stay packed until they are shown. */
export async function readRun(number) {
  return unpackAll(await read(`run-${number}`, `/runs/${number}.json`), ["codes"]);
}

/** Reads the small picture of a run; null if it has none. */
export const readPicture = (number) => read(`picture-${number}`, `/pictures/${number}.json`);

/** Calls `changed` with the numbers of runs that have gone on, every two seconds. */
export function follow(changed, lost) {
  let known = null;
  const ask = async () => {
    try {
      const answer = await fetch("/revisions.json", { cache: "no-store" });
      const now = await answer.json();
      lost(false);
      const before = known ?? now;
      known = now;
      const numbers = now.flatMap((revision, i) => (revision === before[i] ? [] : [i]));
      if (numbers.length) await changed(numbers);
    } catch {
      lost(true);
    }
    setTimeout(ask, 2000);
  };
  ask();
}
