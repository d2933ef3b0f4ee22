// A list that stays under the pointer while what is above it grows and shrinks, so that the next click is on the same row.

/**
 * Keep a list where it is, from a press in it until the pointer leaves it.
 * @param {HTMLElement} list
 * @param {HTMLElement[]} above elements whose height may change
 * @param {() => HTMLElement} scroller that the list lies in
 */
export function keepStill(list, above, scroller) {
  /** @type {number | null} where it was pressed, px from the top of the window */
  let top = null, gap = 0;
  const leave = (/** @type {number} */ px) => {
    gap = px;
    list.style.paddingTop = px ? `${px}px` : "";
  };
  const correct = () => {
    if (top === null) return;
    const around = scroller(), off = list.getBoundingClientRect().top + gap - top, scrolled = around.scrollTop;
    const less = Math.min(Math.max(off, 0), gap); // of a gap that was made before
    leave(gap - less);
    around.scrollTop = scrolled + off - less;
    const left = off - less - (around.scrollTop - scrolled); // where scrolling has come to its end
    if (left < 0) leave(gap - left);
  };
  const watch = new ResizeObserver(correct); // called before the page is painted
  for (const element of above) watch.observe(element);
  list.addEventListener("pointerdown", () => { top ??= list.getBoundingClientRect().top + gap; });
  list.addEventListener("pointerleave", () => {
    top = null;
    leave(0);
  });
}
