"use strict";
// Which rows are shown. A link to a row that is hidden shows all of them first.
const show = (what) => {
  document.body.className = "show-" + what;
  document.querySelectorAll('input[name="show"]').forEach((input) => { input.checked = input.value === what; });
};
document.querySelectorAll('input[name="show"]').forEach((input) => input.addEventListener("change", () => show(input.value)));
document.querySelectorAll('a[href^="#"]').forEach((link) => link.addEventListener("click", () => show("all")));
show("all");
