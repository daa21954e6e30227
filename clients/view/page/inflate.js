// zlib's format, by the browser.

// The `size` bytes that these are unpacked to, or null when they are damaged or unpack to another number. Never keeps more than that.
export async function inflate(packed, size) {
  const unpacked = new Uint8Array(size);
  const reader = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate")).getReader();
  let at = 0;
  try {
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
      if (at + part.value.length > size) {
        reader.cancel().catch(() => {});
        return null;
      }
      unpacked.set(part.value, at);
      at += part.value.length;
    }
  } catch {
    return null;
  }
  return at === size ? unpacked : null;
}
