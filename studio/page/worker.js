// The worker of a page without a server: it executes requests with the module `taut.wasm`, one after another.
"use strict";

/** @type {any} */
const scope = self;

/** Time between two checks for cancellation, ms. */
const LOOKS = 50;

let module,
  made,
  files = [];
let go = "",
  isStopped = false,
  looked = 0;

/** True if the address, which is revoked to cancel an act, still exists. */
function isThere(address) {
  try {
    const request = new XMLHttpRequest();
    request.open("GET", address, false);
    request.send();
    return true;
  } catch {
    return false;
  }
}

const bytes = (at, length) => made.exports.memory.buffer.slice(at, at + length);
const output = length => bytes(made.exports.output() >>> 0, length >>> 0);

const imports = {
  worker: {
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
      scope.postMessage({frame}, [frame]);
    },
  },
};

/** Writes the input of the next call. */
function hand(...parts) {
  let at = made.exports.room(parts.reduce((sum, part) => sum + part.length, 0)) >>> 0;
  for (const part of parts) {
    new Uint8Array(made.exports.memory.buffer).set(part, at);
    at += part.length;
  }
}

const text = words => new TextEncoder().encode(words);
const json = length => JSON.parse(new TextDecoder().decode(output(length)));

/** Stores a file in the module; returns its path or an error. */
function keep({place, file}) {
  try {
    const name = text(file.name);
    hand(name, new Uint8Array(new scope.FileReaderSync().readAsArrayBuffer(file)));
    return json(made.exports.keep(place, name.length));
  } catch (error) {
    return {error: `${file.name} cannot be read: ${error}`};
  }
}

/** Creates an instance of the module with the dropped files. */
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
    // After a trap, such as a panic or exhausted memory, the instance is unusable.
    console.error(error);
    make();
    hand(text(request));
    return output(made.exports.defect());
  }
}

scope.onmessage = ({data}) => {
  if (data.module) {
    ({module, files} = data);
    make();
    scope.postMessage({long: json(made.exports.long_acts())});
  }
  if (data.file) {
    const kept = keep(data.file);
    if (kept.path !== undefined) files.push(data.file);
    else make();
    scope.postMessage({kept, place: data.file.place});
  }
  if (data.ask) {
    // If the address cannot be read at all, the page terminates the worker instead.
    go = data.go && isThere(data.go) ? data.go : "";
    isStopped = false;
    const frame = answer(data.ask);
    scope.postMessage({frame}, [frame]);
  }
};
