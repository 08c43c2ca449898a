// The gallery: which decks are shown, and what moves: what is pointed at or has the focus; where nothing can point, what is seen whole.
// The choice stands in the address, so that it is there again after a deck was opened.
"use strict";

const still = matchMedia("(prefers-reduced-motion: reduce)"), words = document.getElementById("words");
const items = [...document.querySelectorAll("#decks li")].map((li) => ({ li, img: li.querySelector("img"), subjects: li.dataset.subjects.split("|"), title: li.innerText.toLowerCase() }));
const buttons = [...document.querySelectorAll("[data-subject]")], chosen = new Set();

function move(img, on) {
  img.dataset.still ??= img.getAttribute("src");
  const wanted = on && !still.matches ? img.dataset.film : img.dataset.still;
  if (img.getAttribute("src") !== wanted) img.src = wanted;
}

function filter() {
  const asked = words.value.toLowerCase().split(/\s+/).filter(Boolean);
  let count = 0;
  for (const { li, subjects, title } of items) {
    li.hidden = ![...chosen].every((s) => subjects.includes(s)) || !asked.every((w) => title.includes(w));
    count += !li.hidden;
  }
  for (const button of buttons) button.setAttribute("aria-pressed", chosen.has(button.dataset.subject));
  document.getElementById("count").textContent = count === items.length ? "" : `${count} of ${items.length}`;
}

function remember() {
  const kept = new URLSearchParams([...[...chosen].map((s) => ["subject", s]), ...(words.value ? [["words", words.value]] : [])]);
  try { history.replaceState(null, "", `#${kept}`); } catch { /* no address of its own */ }
}

function recall() {
  const kept = new URLSearchParams(location.hash.slice(1));
  chosen.clear();
  kept.getAll("subject").forEach((s) => chosen.add(s));
  words.value = kept.get("words") ?? "";
  filter();
}

for (const button of buttons) button.onclick = () => {
  const { subject } = button.dataset;
  if (!chosen.delete(subject)) chosen.add(subject);
  filter();
  remember();
};
words.oninput = () => { filter(); remember(); };
words.form.onsubmit = (e) => e.preventDefault();
for (const { li, img } of items) {
  for (const [event, on] of [["pointerenter", true], ["pointerleave", false], ["focusin", true], ["focusout", false]]) li.addEventListener(event, () => move(img, on));
}
if (matchMedia("(hover: none)").matches) {
  const seen = new IntersectionObserver((found) => found.forEach((one) => move(one.target, one.isIntersecting)), { threshold: 0.95 });
  for (const { img } of items) seen.observe(img);
}
addEventListener("hashchange", recall);
recall();
