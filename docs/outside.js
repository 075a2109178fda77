// Links that lead out of docs/ have no page in the book. Opened from the source tree's target/book they lead to the file;
// anywhere else they become plain text that names it.
for (const link of document.querySelectorAll('main a[href^="../"]')) {
  const [path, heading] = link.getAttribute("href").split("#");
  const file = path.replace(/\.html$/, ".md");
  if (location.protocol === "file:") {
    link.href = `../${file}${heading ? `#${heading}` : ""}`;
  } else {
    link.title = `in the source tree: ${file.replace("../", "")}`;
    link.removeAttribute("href");
  }
}
