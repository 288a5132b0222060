/* Light and dark: the reader's choice over that of the system, kept for all pages. */
"use strict";
var ferryid = { themed: [] };
(function () {
  const root = document.documentElement;
  const kept = "ferryid-theme";
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const choices = ["auto", "light", "dark"];
  let choice = "auto";
  try {
    choice = localStorage.getItem(kept) || "auto";
  } catch (error) {
    /* A browser may refuse to keep anything for files. */
  }
  /* Asked for anew each time, they would cost more than the drawing. */
  let colours = {};
  function apply() {
    colours = {};
    if (choice === "auto") delete root.dataset.theme;
    else root.dataset.theme = choice;
    ferryid.themed.forEach((redraw) => redraw());
  }
  ferryid.colour = (role) => (colours[role] = colours[role] || getComputedStyle(root).getPropertyValue("--" + role).trim() || "#888");
  ferryid.themeButton = function () {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "theme";
    const name = () => {
      button.textContent = "colours: " + choice;
      button.title = "Colours of the page: of the system, light or dark";
    };
    button.addEventListener("click", () => {
      choice = choices[(choices.indexOf(choice) + 1) % choices.length];
      try {
        localStorage.setItem(kept, choice);
      } catch (error) {
        /* Then it holds for this page alone. */
      }
      name();
      apply();
    });
    name();
    return button;
  };
  dark.addEventListener("change", apply);
  apply();
})();
