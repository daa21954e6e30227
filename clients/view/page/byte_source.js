// Bytes taken one after the other, out of bytes or out of base64.

const LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
const SKIPPED = 64, PADDING = 65, END = 66;
const VALUES = new Uint8Array(256).fill(END);
[...LETTERS].forEach((letter, value) => { VALUES[letter.charCodeAt(0)] = value; });
for (const blank of " \t\r\n") VALUES[blank.charCodeAt(0)] = SKIPPED;
VALUES["=".charCodeAt(0)] = PADDING;

// `take(count)`: the next bytes, or null where there are too few.
export function bytes_source(data, at) {
  return {
    take(count) {
      if (!(count <= data.length - at)) return null;
      const taken = data.slice(at, at + count);
      at += count;
      return taken;
    },
  };
}

// `letters`: bytes of the text. Pieces that were encoded one after the other, each with its own padding, are one sequence: VTK encodes the
// header of compressed data for itself.
export function base64_source(letters, at) {
  const three = new Uint8Array(3);  // of the last four letters
  let first = 0, last = 0;          // those of them that wait
  const next_four = () => {
    let bits = 0, count = 0, padding = 0;
    while (count < 4) {
      const value = at < letters.length ? VALUES[letters[at]] : END;
      if (value === END) return false;
      ++at;
      if (value === SKIPPED) continue;
      padding += value === PADDING;
      bits = (bits << 6) | (value & 63);
      ++count;
    }
    [three[0], three[1], three[2]] = [bits >> 16, bits >> 8, bits];
    [first, last] = [0, 3 - padding];
    return last > 0;
  };
  return {
    take(count) {
      if (!(count <= letters.length)) return null;
      const taken = new Uint8Array(count);
      for (let i = 0; i < count; ++i) {
        if (first >= last && !next_four()) return null;
        taken[i] = three[first++];
      }
      return taken;
    },
  };
}
