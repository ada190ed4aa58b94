// What is wrong with the layout of the page as it is shown: a list of sentences. Texts may neither be cut off nor lie
// on each other, of HTML and of SVG alike, and every colour stands out from the paper.
(() => {
  const problems = [];
  const root = document.documentElement;
  const wide = root.clientWidth || innerWidth;
  if (root.scrollWidth > wide + 1) problems.push(`the page is ${root.scrollWidth} px wide, the window ${wide}`);

  const texts = [];
  const walker = document.createTreeWalker(document.body || root, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const element = walker.currentNode.parentElement;
    const words = walker.currentNode.textContent.trim().slice(0, 50);
    if (!words || element.closest("script, style, title")) continue;
    if (!element.checkVisibility({ visibilityProperty: true })) continue;
    const range = document.createRange();
    range.selectNodeContents(walker.currentNode);
    for (const box of range.getClientRects()) {
      if (box.width > 1 && box.height > 1) texts.push({ words, element, box });
    }
  }
  if (!texts.length) problems.push("there is no text");

  for (const { words, element, box } of texts) {
    let left = 0, right = wide;
    for (let up = element; up; up = up.parentElement) {
      const { overflowX } = getComputedStyle(up);
      const frame = up.getBoundingClientRect();
      if (["auto", "scroll"].includes(overflowX) && up !== root) {
        [left, right] = [-Infinity, Infinity];
        break;
      }
      if (up.tagName.toLowerCase() === "svg" || ["hidden", "clip"].includes(overflowX)) {
        const inside = box.top >= frame.top - 1 && box.bottom <= frame.bottom + 1;
        if (!inside) problems.push(`"${words}" is cut off above or below`);
        [left, right] = [Math.max(left, frame.left), Math.min(right, frame.right)];
      }
    }
    if (box.left < left - 1 || box.right > right + 1) problems.push(`"${words}" is cut off at the side`);
  }

  texts.sort((a, b) => a.box.top - b.box.top);
  for (let i = 0; i < texts.length; i += 1) {
    for (let j = i + 1; j < texts.length && texts[j].box.top < texts[i].box.bottom - 3; j += 1) {
      const [a, b] = [texts[i].box, texts[j].box];
      const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (across > 2 && down > 3) problems.push(`"${texts[i].words}" lies on "${texts[j].words}"`);
    }
  }

  // A mixed colour is given in parts of 1, any other in parts of 255.
  const channels = (colour) => (colour.match(/[\d.]+/g) || [])
    .map((c, i) => (i < 3 && colour.startsWith("color(") ? 255 : 1) * Number(c));
  const luminance = (colour) => channels(colour).slice(0, 3)
    .map((c) => (c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4))
    .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
  const contrast = (a, b) => {
    const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y);
    return (high + 0.05) / (low + 0.05);
  };
  const paper = (element) => {
    for (let up = element; up; up = up.parentElement) {
      const { backgroundColor } = getComputedStyle(up);
      if (channels(backgroundColor)[3] !== 0) return backgroundColor;
    }
    return "rgb(255, 255, 255)";
  };
  // Least contrasts of text and of graphics: WCAG 2.2, success criteria 1.4.3 and 1.4.11.
  const check = (what, colour, element, least) => {
    const found = contrast(colour, paper(element));
    if (found < least) problems.push(`${what}: contrast ${found.toFixed(2)}, least ${least}`);
  };
  for (const { words, element } of texts) {
    if (!element.closest("svg")) check(`"${words}"`, getComputedStyle(element).color, element, 4.5);
  }
  for (const path of document.querySelectorAll(".plot .line, .plot .dots")) {
    check(`a line ${path.getAttribute("class")}`, getComputedStyle(path).stroke, path.closest(".plot"), 3);
  }
  return [...new Set(problems)].slice(0, 12);
})()
