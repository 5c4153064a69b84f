// Poses of a crepesd in Node, without packages.
//   node poses.mjs [ADDRESS [PORT [COUNT]]]
// prints one line a pose: t_ns peer mode x y z [m, in our body's axes].
import dgram from "node:dgram";
import net from "node:net";

const [address = "127.0.0.1", port = "47475", count = "0"] = process.argv.slice(2);
if (!(Number(port) >= 1 && Number(port) <= 65535)) {
  console.error(`${port} is no port, 1 to 65535`);
  process.exit(2);
}
const line = dgram.createSocket(net.isIPv6(address) ? "udp6" : "udp4");
let cookie = { pad: " ".repeat(64) }; // a daemon elsewhere answers no shorter request
let left = Number(count);
let heard = Date.now();

function ask(enable, then) {
  const request = JSON.stringify({ class: "WATCH", enable, ...cookie });
  line.send(request, Number(port), address, then);
}

function end(code, complaint) {
  clearInterval(renewal);
  if (complaint) console.error(complaint);
  ask(false, () => { line.close(); process.exitCode = code; });
}

line.on("message", (bytes) => {
  const message = JSON.parse(bytes);
  heard = Date.now();
  if (message.class === "COOKIE") {
    cookie = { cookie: message.cookie };
    ask(true);
  } else if (message.class === "ERROR") {
    end(1, message.message);
  } else if (message.class === "POSE") {
    const { t_ns, peer, mode, position: p } = message;
    console.log(t_ns, peer, mode, p.x, p.y, p.z);
    left -= 1;
    if (left === 0) end(0);
  }
});
line.on("error", (fault) => end(1, fault.message));
process.stdout.on("error", () => process.exit(0)); // its reader has ended, as head does

ask(true);
const renewal = setInterval(() => { // the lease is ten seconds: a lost datagram does not matter
  if (Date.now() - heard > 3000) return end(1, `no answer from ${address} port ${port}`);
  ask(true);
}, 1000);
