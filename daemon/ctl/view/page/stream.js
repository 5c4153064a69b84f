// The server's data: one request, or a stream of server-sent events that is opened again when it ends.
// Not by EventSource, which cannot send the token.

const RETRY_MS = 500;
const SILENT_MS = 12000; // the server writes at least every five seconds

// In the fragment, which browsers send to nobody; out of sight and history once it is read.
const token = new URLSearchParams(location.hash.slice(1)).get("token") || sessionStorage.getItem("token");
if (token) {
  sessionStorage.setItem("token", token);
  history.replaceState(null, "", location.pathname);
}

async function request(path, signal, method = "GET") {
  const headers = token ? { authorization: `Bearer ${token}` } : {};
  const reply = await fetch(path, { method, headers, signal, cache: "no-store", credentials: "omit" });
  if (!reply.ok) throw new Error(`${(await reply.text()).trim()} (${reply.status})`);
  return reply;
}

/** Changes something; an error says why it was refused. */
export async function post(path) {
  await (await request(path, undefined, "POST")).text();
}

export async function load(path) {
  return (await request(path)).json();
}

/** The events in `text` that are complete, and what is left of it. */
export function eventsIn(text) {
  const parts = text.split("\n\n");
  const rest = parts.pop();
  const events = [];
  for (const part of parts) {
    const fields = Object.fromEntries(part.split("\n").map((line) => [line.slice(0, line.indexOf(":")), line.slice(line.indexOf(":") + 2)]));
    if (fields.event && fields.data) events.push({ name: fields.event, data: JSON.parse(fields.data) });
  }
  return { events, rest };
}

/** Calls `onEvent(name, data)` for each event and `onBreak(error)` whenever the stream ends. Stop it with the returned function. */
export function listen(path, onEvent, onBreak) {
  let isOver = false;
  let abort = new AbortController();
  const read = async () => {
    const reply = await request(path, abort.signal);
    const reader = reply.body.pipeThrough(new TextDecoderStream()).getReader();
    let text = "";
    for (;;) {
      const timer = setTimeout(() => abort.abort(), SILENT_MS);
      const { value, done } = await reader.read().finally(() => clearTimeout(timer));
      if (done) throw new Error("the page's server has stopped");
      const { events, rest } = eventsIn(text + value);
      text = rest;
      for (const { name, data } of events) onEvent(name, data);
    }
  };
  const run = async () => {
    while (!isOver) {
      abort = new AbortController();
      try {
        await read();
      } catch (error) {
        if (isOver) return;
        onBreak(error.name === "TypeError" || error.name === "AbortError" ? new Error("no connection to crepesctl view") : error);
      }
      await new Promise((resume) => setTimeout(resume, RETRY_MS));
    }
  };
  run();
  return () => {
    isOver = true;
    abort.abort();
  };
}
