"""`emsim view --live`: a deck that is being edited, run again and again, and its page in a browser.

watch.py     which of the deck's files changed
runs.py      one run at a time, in a process that a newer run ends;  worker.py is that process
session.py   when to run, and what the page is to know
server.py    the page and its data, on loopback
"""
