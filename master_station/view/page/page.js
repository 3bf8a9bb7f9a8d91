// The live page: what came last is shown, and told to have been taken; what would come faster than it is drawn is not sent.
import "./page.css";
import { Charts } from "./charts.js";
import * as messages from "./messages.js";
import { Scene3d, qualityOf } from "./scene3d.js";

const CHARTS_EVERY_MS = 100;
const AGAIN_MS = 1000;
const DOUBTS = [[2, "at the window's border"], [4, "at an edge"], [8, "grazing"], [16, "in several layers"], [32, "unresolved"], [64, "felt as coarse"]];
const STATE_WORDS = {
  free: "nothing is touched", touching: "touching", held: "news from the remote is late", fading: "force fades", fault: "force is off", paused: "paused, force is off",
};
const $ = (id) => document.getElementById(id);

const dark = matchMedia("(prefers-color-scheme: dark)");
const scene = new Scene3d($("view3d"), showPicked);
const charts = new Charts($("charts"));
scene.setDark(dark.matches);
dark.addEventListener("change", () => {
  scene.setDark(dark.matches);
  charts.build();
});

let socket = null, newest = null, drawn = null, chartsDrawn = 0, isOver = false, isPaused = false, names = [];

function connect() {
  socket = new WebSocket(`ws://${location.host}/`, "farfeel-view");
  socket.binaryType = "arraybuffer";
  socket.onopen = () => socket.send(messages.tokenMessage(location.hash.slice(1)));
  socket.onmessage = ({ data }) => take(data);
  socket.onclose = ({ code }) => {
    if (code === 1008) {
      over("This address is not that of the running view.", "Open the one that the session printed.");
      return;
    }
    over("The session has ended, or its view has.", "Start a session, and open the address that it prints.");
    setTimeout(connect, AGAIN_MS);
  };
}

function over(happened, toDo) {
  isOver = true;
  showBanner("trouble", happened, toDo);
  $("state").textContent = "not connected";
}

function take(data) {
  switch (messages.kindOf(data)) {
    case messages.KIND.scene:
      $("scene-name").textContent = scene.begin(messages.readScene(data)).name;
      charts.clear();
      isOver = false;
      names = [];
      showBanner("quiet", "", "");
      break;
    case messages.KIND.body: {
      const body = messages.readBody(data);
      names[body.index] = body.name;
      scene.addBody(body);
      break;
    }
    case messages.KIND.tiles:
      scene.addTiles(messages.readTiles(data));
      break;
    case messages.KIND.presence: {
      const here = messages.readPresence(data);
      scene.showPresence(here);
      $("tiles-here").textContent = `${here.reduce((n, is) => n + is, 0)} of ${here.length}`;
      break;
    }
    case messages.KIND.history:
      for (const moment of messages.readHistory(data)) charts.add(moment);
      break;
    case messages.KIND.status:
      showStatus(messages.readStatus(data));
      break;
    case messages.KIND.answer: {
      const answer = messages.readAnswer(data);
      $("answer").textContent = sentence(answer.words);
      $("answer").classList.toggle("refused", !answer.done);
      break;
    }
    case messages.KIND.tick:
      newest = messages.readTick(data);
      charts.add(newest);
      if (document.hidden) socket.send(messages.takenMessage(newest.number));  // nothing is drawn there
      break;
  }
}

const sentence = (words) => words && `${words.charAt(0).toUpperCase()}${words.slice(1)}${/[.!?]$/.test(words) ? "" : "."}`;

function showBanner(tone, happened, toDo) {
  $("banner").hidden = tone === "quiet";
  $("banner").className = tone;
  $("happened").textContent = sentence(happened);
  $("to-do").textContent = sentence(toDo);
}

function showStatus(status) {
  if (!isOver) showBanner(status.tone, status.happened, status.toDo);
  isPaused = status.paused;
  $("pause").textContent = isPaused ? "Resume (p)" : "Pause (p)";
  fill($("words"), status.words);
}

function fill(list, words) {
  list.replaceChildren(...words.flatMap(([label, text]) => {
    const dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = label;
    dd.textContent = text;
    return [dt, dd];
  }));
}

function showPicked() {
  const push = newest && newest.pushes[scene.picked];
  if (!push) {
    fill($("picked"), []);
    return;
  }
  const newtons = Math.hypot(...push.force), vec = (v, digits, scale) => v.map((x) => (x * scale).toFixed(digits)).join(", ");
  const doubts = DOUBTS.filter(([bit]) => push.doubts & bit).map(([, word]) => word).join(", ");
  fill($("picked"), [
    ["Contact", `${scene.picked + 1} of ${newest.pushes.length}, on ${names[push.object + 1] || push.object}`],
    ["Force", `${newtons.toFixed(3)} N (${vec(push.force, 3, 1)})`],
    ["Depth", `${(1e6 * push.depth).toFixed(1)} µm`],
    ["Point", `${vec(push.point, 2, 1e3)} mm`],
    ["Direction", vec(push.normal, 3, 1)],
    ["Quality", qualityOf(push) === "good" ? "no doubt" : doubts || qualityOf(push)],
    ["Known from", messages.SOURCES[push.source]],
  ]);
}

function draw(now) {
  requestAnimationFrame(draw);
  if (newest && newest !== drawn) {
    scene.show(newest);
    drawn = newest;
    const state = messages.STATES[newest.state], force = Math.hypot(...newest.hand.force);
    $("state").textContent = isOver ? "not connected" : `${STATE_WORDS[state]} · ${force.toFixed(2)} N on the hand · ${newest.pressing} contacts · tick ${newest.number}`;
    $("scale").textContent = `an arrow of 1 N is ${(1e3 * scene.metresPerNewton).toFixed(1)} mm long`;
    if (scene.picked >= 0) showPicked();
    if (socket.readyState === WebSocket.OPEN) socket.send(messages.takenMessage(drawn.number));
  }
  scene.draw();
  if (now - chartsDrawn > CHARTS_EVERY_MS) {
    chartsDrawn = now;
    charts.draw();
  }
}

for (const button of document.querySelectorAll("[data-view]")) button.addEventListener("click", () => scene.look(button.dataset.view));
const CONTROLS = { reset: () => "resetFault", pause: () => (isPaused ? "resume" : "pause"), recentre: () => "recentre" };
function ask(control) {
  if (socket.readyState === WebSocket.OPEN) socket.send(messages.controlMessage(messages.VERB[CONTROLS[control]()]));
}
for (const control of Object.keys(CONTROLS)) $(control).addEventListener("click", () => ask(control));
$("tiles").addEventListener("click", () => $("tiles").setAttribute("aria-pressed", scene.toggleTiles()));
addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const view = { 1: "orbit", 2: "top", 3: "device", 4: "tool" }[event.key];
  if (view) scene.look(view);
  if (event.key === "t") $("tiles").click();
  const control = { p: "pause", c: "recentre", r: "reset" }[event.key];
  if (control && !event.repeat) ask(control);
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (step && newest && newest.pushes.length > 0) {
    const count = newest.pushes.length;
    scene.pick((Math.max(scene.picked, step > 0 ? -1 : 0) + step + count) % count);
  }
  if (event.key === "Escape") scene.pick(-1);
});

// What is shown now, read off what is drawn: for tests.
window.farfeelShown = () => drawn && {
  number: drawn.number, time: drawn.time, forces: scene.shownForces(), state: drawn.state, tool: drawn.tool.p, handle: drawn.handle.p,
  points: charts.times.length, seconds: charts.times.length > 0 ? charts.times[charts.times.length - 1] - charts.times[0] : 0,
  tiles: scene.shownTiles(), camera: scene.camera.position.toArray(),
};

connect();
requestAnimationFrame(draw);
