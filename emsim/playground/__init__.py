"""The playground: a page with an editor in which emsim itself runs. `site.py` makes its folder, `desk.py` answers in the page."""
