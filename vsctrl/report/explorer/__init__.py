"""The explorer on a page: sliders that move a loop's numbers, computed in the browser as here."""
