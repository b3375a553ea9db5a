// Unpacks the arrays of crates/view/src/packed.rs: base64, deflated, little-endian.

const TYPES = {
  u8: Uint8Array,
  u16: Uint16Array,
  u32: Uint32Array,
  f32: Float32Array,
  f64: Float64Array,
};

function fromBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

/** Returns the numbers of one packed array. */
export async function unpack(node) {
  const inflated = new Blob([fromBase64(node.data)])
    .stream()
    .pipeThrough(new DecompressionStream("deflate-raw"));
  const numbers = new TYPES[node.packed](await new Response(inflated).arrayBuffer());
  if (node.packed === "u8") {
    for (let i = 1; i < numbers.length; i++) numbers[i] += numbers[i - 1];
  }
  if (node.scale === undefined) return numbers;
  return Float32Array.from(numbers, (code) => code * node.scale + node.offset);
}

/** Replaces all packed arrays below `node`, except under keys in `later`. */
export async function unpackAll(node, later = []) {
  if (node === null || typeof node !== "object") return node;
  if (node.packed) return unpack(node);
  const entries = Object.entries(node).filter(([key]) => !later.includes(key));
  await Promise.all(
    entries.map(async ([key, value]) => {
      if (value !== null && typeof value === "object") node[key] = await unpackAll(value, later);
    }),
  );
  return node;
}
