// The scene as pairs of key and value: in the page's address, as lines for the computing, and as a command.

// What stands in an address as it is.
const PLAIN = /[^\w.:@,+\-]/g;
const encoded = (text) => text.replace(PLAIN, (letter) => encodeURIComponent(letter));

// The pairs of an address: `#key=value&key=value`.
export function pairsOf(hash) {
  const pairs = new Map();
  for (const part of hash.replace(/^#/, "").split("&")) {
    const at = part.indexOf("=");
    if (at < 1) continue;
    try {
      pairs.set(decodeURIComponent(part.slice(0, at)), decodeURIComponent(part.slice(at + 1)));
    } catch {
      // A broken escape: the pair is left out.
    }
  }
  return pairs;
}

export const hashOf = (pairs) => [...pairs].map(([key, value]) => `${encoded(key)}=${encoded(value)}`).join("&");

export const linesOf = (pairs) => [...pairs].map(([key, value]) => `${key}=${value}`).join("\n");

export function commandOf(pairs) {
  const quoted = (value) => /^[\w.:@,+\-]*$/.test(value) ? "" : "'";
  const sets = [...pairs].map(([key, value]) => ` --set ${quoted(value)}${key}=${value}${quoted(value)}`);
  return `cargo run --release -- position${sets.join("")}`;
}
