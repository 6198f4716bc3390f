// Opens a figure as large as the window, or larger than a phone: by click, tap or Enter; Esc or a click closes.
// Without this script, or in a new tab, the link around a figure leads to its file.
{
  const make = (tag, properties, ...children) => {
    const element = Object.assign(document.createElement(tag), properties);
    element.append(...children);
    return element;
  };
  const large = make("img", {});
  const close = make("button", { type: "button", textContent: "Close" });
  const sheet = make("div", { className: "sheet", tabIndex: 0 }, large);
  const dialog = make("dialog", { className: "large-figure" }, close, sheet);
  sheet.setAttribute("role", "group");
  document.body.append(dialog);
  dialog.addEventListener("click", () => dialog.close());
  dialog.addEventListener("keydown", ({ key }) => key === "Escape" && dialog.close()); // also where the browser does not

  document.querySelectorAll(".bd-content figure > img").forEach((image) => {
    const link = make("a", { className: "to-large-figure", href: image.src, title: "Open larger" });
    image.replaceWith(link);
    link.append(image);
    link.addEventListener("click", (event) => {
      if (event.ctrlKey || event.metaKey || event.shiftKey) return;
      event.preventDefault();
      Object.assign(large, { src: image.src, alt: image.alt });
      const name = link.parentElement.querySelector(".caption-number")?.textContent.trim() ?? "Figure";
      dialog.setAttribute("aria-label", name);
      sheet.setAttribute("aria-label", name);
      dialog.showModal();
      sheet.scrollTo(0, 0);
      sheet.focus();
    });
  });
}
