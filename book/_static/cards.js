// A card shows what a link leads to - a figure, an equation, an erratum, a reference - while the mouse or the
// keyboard is on the link. Esc closes it; the mouse may move onto it. A touch follows the link, as ever.
{
  const data = document.getElementById("cards");
  const cards = data ? JSON.parse(data.textContent) : {};
  const card = Object.assign(document.createElement("div"), { id: "hover-card", hidden: true });
  card.setAttribute("role", "tooltip");
  document.body.append(card);
  let shown = null; // the link whose card is shown, or will be
  let timer;

  const hide = () => {
    clearTimeout(timer);
    shown?.removeAttribute("aria-describedby");
    shown = null;
    card.hidden = true;
  };
  const place = () => {
    const gap = 6;
    const { left, top, bottom } = shown.getClientRects()[0];
    const { width, height } = card.getBoundingClientRect();
    const below = bottom + gap + height <= window.innerHeight || top < window.innerHeight - bottom;
    card.style.left = `${Math.max(gap, Math.min(left, document.documentElement.clientWidth - width - gap))}px`;
    card.style.top = `${below ? bottom + gap : Math.max(gap, top - gap - height)}px`;
  };
  const show = async (link) => {
    card.innerHTML = cards[link.getAttribute("href")];
    card.style.left = card.style.top = "0"; // its full width is free while it is measured
    card.hidden = false;
    link.setAttribute("aria-describedby", card.id);
    place();
    const images = [...card.querySelectorAll("img")].map((image) => image.decode().catch(() => {}));
    await Promise.all([window.MathJax?.startup.promise.then(() => MathJax.typesetPromise([card])), ...images]);
    if (shown === link) place();
  };
  const later = (wait, action) => {
    clearTimeout(timer);
    timer = setTimeout(action, wait);
  };
  const want = (link, wait) => {
    if (link === shown) return clearTimeout(timer); // the mouse is back before the card has gone
    hide();
    shown = link;
    later(wait, () => show(link));
  };

  for (const link of document.querySelectorAll("article a.reference.internal")) {
    if (!(link.getAttribute("href") in cards)) continue;
    link.addEventListener("pointerenter", ({ pointerType }) => pointerType === "mouse" && want(link, 250));
    link.addEventListener("pointerleave", () => link === shown && later(200, hide));
    link.addEventListener("focus", () => link.matches(":focus-visible") && want(link, 0));
    link.addEventListener("blur", hide);
    link.addEventListener("click", hide);
  }
  card.addEventListener("pointerenter", () => clearTimeout(timer));
  card.addEventListener("pointerleave", () => later(200, hide));
  document.addEventListener("keydown", ({ key }) => key === "Escape" && hide());
  document.addEventListener("scroll", () => card.hidden || hide(), { passive: true });
}
