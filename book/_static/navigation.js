// What opens a list of pages beside the text has a name for who does not see it: that of the page above them.
document.querySelectorAll("nav details > summary").forEach((summary) => {
  const page = summary.closest("li").querySelector("a").textContent.trim();
  summary.setAttribute("aria-label", `pages of ${page}`);
});
