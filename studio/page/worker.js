// The worker of a page without a server: it does with the module `taut.wasm` what it is asked for, one after another.
"use strict";

/** Time between two looks whether a work is to go on, ms. */
const LOOKS = 50;

let module, made, files = [];
let go = "", isStopped = false, looked = 0;

/** Whether the address that lets a work go on is there. */
function isThere(address) {
  try {
    const request = new XMLHttpRequest();
    request.open("GET", address, false);
    request.send();
    return true;
  } catch { return false; }
}

const bytes = (at, length) => made.exports.memory.buffer.slice(at, at + length);
const output = length => bytes(made.exports.output() >>> 0, length >>> 0);

const imports = {worker: {
  seconds: () => performance.now() / 1000,
  is_stopped: () => {
    if (go && !isStopped && performance.now() - looked > LOOKS) {
      isStopped = !isThere(go);
      looked = performance.now();
    }
    return Number(isStopped);
  },
  tell: (at, length) => {
    const frame = bytes(at >>> 0, length >>> 0);
    postMessage({frame}, [frame]);
  },
}};

/** Hands parts to the module, one after another. */
function hand(...parts) {
  let at = made.exports.room(parts.reduce((sum, part) => sum + part.length, 0)) >>> 0;
  for (const part of parts) { new Uint8Array(made.exports.memory.buffer).set(part, at); at += part.length; }
}

const text = words => new TextEncoder().encode(words);
const json = length => JSON.parse(new TextDecoder().decode(output(length)));

/** Has the module keep a file: its path, or what is wrong. */
function keep({place, file}) {
  try {
    const name = text(file.name);
    hand(name, new Uint8Array(new FileReaderSync().readAsArrayBuffer(file)));
    return json(made.exports.keep(place, name.length));
  } catch (error) { return {error: `${file.name} cannot be read: ${error.message}`}; }
}

/** Makes an instance of the module, with the files that were dropped. */
function make() {
  made = new WebAssembly.Instance(module, imports);
  files.forEach(keep);
}

/** The answer to a request, a frame. */
function answer(request) {
  try {
    hand(text(request));
    return output(made.exports.ask());
  } catch (error) {
    // A defect, or no more memory: this instance is not to be used any more.
    console.error(error);
    make();
    hand(text(request));
    return output(made.exports.defect());
  }
}

onmessage = ({data}) => {
  if (data.module) {
    ({module, files} = data);
    make();
    postMessage({long: json(made.exports.long_acts())});
  }
  if (data.file) {
    const kept = keep(data.file);
    if (kept.path !== undefined) files.push(data.file); else make();
    postMessage({kept, place: data.file.place});
  }
  if (data.ask) {
    // Where it cannot be looked at, the page ends the worker instead.
    go = data.go && isThere(data.go) ? data.go : "";
    isStopped = false;
    const frame = answer(data.ask);
    postMessage({frame}, [frame]);
  }
};
