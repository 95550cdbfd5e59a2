const words = new Intl.Collator("en", {numeric: true});
for (const button of document.querySelectorAll("th[data-column] button")) button.addEventListener("click", () => {
  const heading = button.parentElement, table = heading.closest("table"), body = table.tBodies[0];
  const up = heading.getAttribute("aria-sort") !== "ascending", sign = up ? 1 : -1;
  const key = row => {
    const cell = row.cells[heading.dataset.column], text = cell.dataset.value ?? cell.textContent;
    return cell.classList.contains("number") ? parseFloat(text) : text; };
  const missing = value => value === "" || Number.isNaN(value);  // last, whichever way
  const order = (a, b) => missing(a) || missing(b) ? missing(a) - missing(b)
    : typeof a === typeof b ? sign * (typeof a === "number" ? a - b : words.compare(a, b))
    : typeof a === "number" ? -1 : 1;
  for (const other of table.querySelectorAll("[aria-sort]")) other.removeAttribute("aria-sort");
  for (const row of table.querySelectorAll(".break")) row.classList.remove("break");
  heading.setAttribute("aria-sort", up ? "ascending" : "descending");
  body.append(...[...body.rows].sort((a, b) => order(key(a), key(b))));
});
const reveal = () => {
  for (let part = document.getElementById(location.hash.slice(1)); part; part = part.parentElement)
    if (part.tagName === "DETAILS") part.open = true; };
reveal();
addEventListener("hashchange", reveal);
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach(part => part.open = true));
