// Load and hostility: cargo xtask load runs this against a studio.
//
//   node load.mjs TAUT [--clients 50] [--seconds 20] [--requests 10000]
//
// Clients drag at once over sockets of their own, requests come by the thousand, and hostile ones in between; the
// server's memory is measured throughout. An hour of dragging: --seconds 3600.
import {spawn} from "node:child_process";
import {existsSync, readFileSync} from "node:fs";
import {request} from "node:http";
import {connect} from "node:net";
import {loadavg} from "node:os";

const [taut, ...words] = process.argv.slice(2);
const option = (name, usual) => {
  const place = words.indexOf(name);
  return place < 0 ? usual : Number(words[place + 1]);
};
const CLIENTS = option("--clients", 50),
  SECONDS = option("--seconds", 20),
  REQUESTS = option("--requests", 10_000);
const CASE = "stages/sollmann-jouaneh/table4.toml";

const child = spawn(taut, ["studio", CASE, "--no-open"], {stdio: ["ignore", "pipe", "inherit"]});
const address = new URL(
  await new Promise(done => child.stdout.once("data", data => done(String(data).split("\n")[0]))),
);
const {port} = address,
  host = `127.0.0.1:${port}`;
const ask = (path, headers = {}, method = "GET") =>
  new Promise(done => {
    const asked = request({host: "127.0.0.1", port, path, method, headers: {host, ...headers}}, answer => {
      answer.resume();
      answer.on("end", () => done({status: answer.statusCode, headers: answer.headers}));
    });
    asked.on("error", error => done({status: 0, headers: {}, error}));
    asked.end();
  });
const cookie = String((await ask(`/${address.search}`)).headers["set-cookie"]).split(";")[0];

/** Resident memory of the server, MB. */
const memory = () => {
  const path = `/proc/${child.pid}/status`;
  return existsSync(path) ? Number(/VmRSS:\s+(\d+)/.exec(readFileSync(path, "utf8"))[1]) / 1000 : NaN;
};

// ---- Sockets, as little as is needed of them: node's own cannot say a cookie

function socket() {
  return new Promise((done, failed) => {
    const stream = connect(Number(port), "127.0.0.1");
    let buffer = Buffer.alloc(0),
      isOpen = false;
    const own = {
      stream,
      onmessage: () => {},
      send(text) {
        const data = Buffer.from(text),
          head =
            data.length < 126
              ? Buffer.from([0x81, 0x80 | data.length])
              : data.length < 65536
                ? Buffer.from([0x81, 0x80 | 126, data.length >> 8, data.length & 255])
                : Buffer.concat([Buffer.from([0x81, 0x80 | 127, 0, 0, 0, 0]), u32(data.length)]);
        stream.write(Buffer.concat([head, Buffer.alloc(4), data]));
      },
    };
    stream.write(
      `GET /socket HTTP/1.1\r\nHost: ${host}\r\nOrigin: http://${host}\r\nCookie: ${cookie}\r\n`
        + `Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n`
        + `Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n`,
    );
    stream.on("error", failed);
    stream.on("close", () => {
      if (!isOpen) failed(new Error("closed"));
    });
    stream.on("data", data => {
      buffer = Buffer.concat([buffer, data]);
      if (!isOpen) {
        const end = buffer.indexOf("\r\n\r\n");
        if (end < 0) return;
        if (!buffer.toString("latin1", 0, 12).endsWith("101")) {
          failed(new Error(buffer.toString("latin1", 0, 40)));
          return;
        }
        isOpen = true;
        buffer = buffer.subarray(end + 4);
        done(own);
      }
      for (;;) {
        if (buffer.length < 2) return;
        let length = buffer[1] & 127,
          at = 2;
        if (length === 126) {
          if (buffer.length < 4) return;
          length = buffer.readUInt16BE(2);
          at = 4;
        } else if (length === 127) {
          if (buffer.length < 10) return;
          length = Number(buffer.readBigUInt64BE(2));
          at = 10;
        }
        if (buffer.length < at + length) return;
        own.onmessage(buffer[0] & 15, buffer.subarray(at, at + length));
        buffer = buffer.subarray(at + length);
      }
    });
  });
}
function u32(value) {
  const bytes = Buffer.alloc(4);
  bytes.writeUInt32BE(value);
  return bytes;
}

// ---- Dragging

const text = readFileSync(CASE, "utf8"),
  troubles = [],
  waits = [],
  samples = [];
let answers = 0,
  wrong = 0;
async function drag(k) {
  const own = await socket(),
    end = Date.now() + 1000 * SECONDS;
  let id = 0;
  await new Promise(done => {
    let asked = 0,
      value = 0,
      begun = 0;
    const next = () => {
      if (Date.now() > end) {
        own.stream.destroy();
        done();
        return;
      }
      value = Number((0.2 + ((asked * 37 + k * 11) % 160) / 100).toPrecision(4));
      begun = performance.now();
      asked++;
      own.send(JSON.stringify({id: ++id, do: "run", text, set: [["cart.mass", value]]}));
    };
    own.onmessage = (kind, data) => {
      if (kind !== 2) {
        if (kind === 8) {
          troubles.push("the server closed a socket");
          done();
        }
        return;
      }
      const head = JSON.parse(data.toString("utf8", 4, 4 + data.readUInt32LE(0)));
      if (head.error || head.id !== id) {
        wrong++;
        troubles.push(JSON.stringify(head.error || head.id));
      } else if (head.values.find(([key]) => key === "cart.mass")[1] !== value) {
        wrong++;
        troubles.push(`asked for ${value}, got ${head.values.find(([key]) => key === "cart.mass")[1]}`);
      }
      answers++;
      waits.push(performance.now() - begun);
      // As fast as a screen asks.
      setTimeout(next, 16);
    };
    own.stream.on("close", done);
    next();
  });
}

const before = memory();
const watch = setInterval(() => samples.push(memory()), Math.max(200, 10 * SECONDS));
const loaded = loadavg()[0];
await Promise.all(Array.from({length: CLIENTS}, (_, k) => drag(k).catch(error => troubles.push(String(error)))));
const dragged = memory();

// ---- Requests, every fourth of them hostile

const kinds = [
  ["the page", () => ask("/", {cookie}), 200],
  ["a script", () => ask("/app.js", {cookie}), 200],
  ["no cookie", () => ask("/"), 403],
  ["another host", () => ask("/", {cookie, host: "evil.example"}), 403],
  ["another origin", () => ask("/", {cookie, origin: "http://evil.example"}), 403],
  ["a wrong token", () => ask("/?token=0000"), 403],
  ["out of the folder", () => ask("/..%2f..%2fetc/passwd", {cookie}), 404],
  ["an upload without an origin", () => ask("/upload?name=x", {cookie}, "POST"), 403],
];
const counts = new Map();
let asked = 0;
const begun = Date.now();
await Promise.all(
  Array.from({length: 64}, async () => {
    while (asked < REQUESTS) {
      const [name, work, wanted] = kinds[asked++ % kinds.length];
      const {status, error} = await work();
      counts.set(name, (counts.get(name) || 0) + 1);
      if (status !== wanted) {
        wrong++;
        troubles.push(`${name}: ${status} and not ${wanted} ${error || ""}`);
      }
    }
  }),
);
const took = (Date.now() - begun) / 1000,
  after = memory();
clearInterval(watch);
const alive = (await ask("/", {cookie})).status === 200;

// ---- What came of it

waits.sort((a, b) => a - b);
const half = samples.slice(samples.length / 2),
  MB = value => `${value.toFixed(1)} MB`;
const mean = list => list.reduce((sum, value) => sum + value, 0) / Math.max(1, list.length);
console.log("| what | measured |\n|---|---|");
console.log(`| clients that dragged at once, each asking again 16 ms after its answer | ${CLIENTS} for ${SECONDS} s |`);
console.log(`| exact runs answered | ${answers}, ${(answers / SECONDS).toFixed(0)} a second |`);
console.log(
  `| from asking to the answer: half within, 95 % within `
    + `| ${(waits[waits.length >> 1] ?? NaN).toFixed(0)} ms, `
    + `${(waits[Math.floor(0.95 * waits.length)] ?? NaN).toFixed(0)} ms |`,
);
console.log(`| requests, of which ${Math.round((100 * 6) / 8)} % hostile | ${asked} in ${took.toFixed(1)} s |`);
console.log(`| answers that were not as they should be | ${wrong} |`);
console.log(
  `| memory at the start, in the middle of the drags, at their end, after the requests `
    + `| ${MB(before)}, ${MB(mean(half))}, ${MB(dragged)}, ${MB(after)} |`,
);
console.log(`\nWith a load of ${loaded.toFixed(1)} before it began.`);
for (const trouble of [...new Set(troubles)].slice(0, 10)) console.log(`  ${trouble}`);
child.kill("SIGTERM");
const ended = await new Promise(done => {
  child.once("exit", () => done(true));
  setTimeout(() => done(false), 2000);
});
const isFlat = !(after > 2 * Math.max(mean(half), before) + 20);
console.log(
  `the server ${alive ? "answered" : "did not answer"} in the end, and `
    + `${ended ? "ended within two seconds" : "did not end"}${isFlat ? "" : "; its memory grew"}`,
);
process.exit(!wrong && !troubles.length && alive && ended && isFlat ? 0 : 1);
