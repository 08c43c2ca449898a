// emsim in a worker of the playground: Pyodide, emsim's files, and one request after the other to emsim/playground/desk.py. Requests are
// {id, what, args}, answers {id, answer: JSON} or {id, failed: text}; {share}: how much of a run is done.
import { loadPyodide } from "./pyodide/pyodide.mjs";

const FOLDER = "/deck";

async function begin() {
  const [python, files] = await Promise.all([loadPyodide({ indexURL: new URL("./pyodide/", import.meta.url).href }), fetch("emsim.zip").then((answer) => answer.arrayBuffer())]);
  python.unpackArchive(files, "zip", { extractDir: "/lib/emsim" });
  python.FS.mkdirTree(FOLDER);
  python.globals.set("tell", (share) => postMessage({ share }));
  return python.runPython(`
import os, sys
sys.path.insert(0, "/lib/emsim")
os.chdir("${FOLDER}")
from emsim.playground.desk import Desk
Desk(tell)
`);
}

const beginning = begin();
beginning.then(() => postMessage({ ready: true }), (error) => postMessage({ failed: String(error) }));
let last = beginning;
onmessage = ({ data: { id, what, args } }) => {
  last = last.then(async () => {
    const desk = await beginning;
    postMessage({ id, answer: desk[what](...args) });
  }).catch((error) => postMessage({ id, failed: String(error) }));
};
