"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);

/** An element with attributes and children. Strings become text, never markup. */
function make(tag, attributes, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes || {})) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

function makeSvg(tag, attributes) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

/** What the browser remembers between visits; browsers may forbid it. */
const memory = {
  get(key) { try { return localStorage.getItem(key); } catch { return null; } },
  set(key, value) { try { localStorage.setItem(key, value); return true; } catch { return false; } },
};

/** Whether a key press is meant for a control that uses it. */
const isTyping = (event) =>
  event.ctrlKey || event.metaKey || event.altKey ||
  (event.target instanceof Element && event.target.matches("input, select, textarea"));

/** Light, dark, or as the system wishes; the button takes turns. */
function themeButton(button) {
  const themes = ["auto", "light", "dark"];
  let theme = memory.get("trueup-theme");
  if (!themes.includes(theme)) theme = "auto";
  const show = () => {
    if (theme === "auto") delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = theme;
    button.textContent = `Theme: ${theme}`;
  };
  button.addEventListener("click", () => {
    theme = themes[(themes.indexOf(theme) + 1) % themes.length];
    memory.set("trueup-theme", theme);
    show();
  });
  show();
}

/**
 * Where all views look. `u` and `v` are how far the middle of a view is moved, in widths and heights of the view at zoom 1.
 */
class Gaze {
  constructor() {
    this.views = [];
    this.reset();
  }
  reset() {
    [this.u, this.v, this.zoom] = [0, 0, 1];
    this.show();
  }
  /** Moves by parts of a view's width and height as it is seen. */
  move(right, down) {
    this.u = Math.max(-1, Math.min(1, this.u + right / this.zoom));
    this.v = Math.max(-1, Math.min(1, this.v + down / this.zoom));
    this.show();
  }
  /** Zooms about a place of the view, given as parts of its width and height from its middle. */
  zoomBy(factor, x = 0, y = 0) {
    const zoom = Math.max(0.25, Math.min(64, this.zoom * factor));
    this.u += x / this.zoom - x / zoom;
    this.v += y / this.zoom - y / zoom;
    this.zoom = zoom;
    this.move(0, 0);
  }
  show() {
    for (const view of this.views) view.show();
  }
  /** Keys of a view that has the focus; true if the key was one of them. */
  key(event) {
    const step = event.shiftKey ? 0.5 : 0.1;
    const act = {
      ArrowLeft: () => this.move(-step, 0), ArrowRight: () => this.move(step, 0),
      ArrowUp: () => this.move(0, -step), ArrowDown: () => this.move(0, step),
      "+": () => this.zoomBy(1.25), "=": () => this.zoomBy(1.25), "-": () => this.zoomBy(0.8), "0": () => this.reset(),
    }[event.key];
    if (act) act();
    return Boolean(act);
  }
}

/**
 * A window onto pictures that lie on each other. Places are kept in parts of the window, so that they hold for any size of
 * it, on paper too. A frame {left, top, width, height} is what the window shows at zoom 1; a box is where a picture lies, in
 * the same units.
 */
class View {
  constructor(gaze, aspect, label, wheelZooms = false) {
    [this.gaze, this.aspect, this.planes] = [gaze, aspect, []];
    this.element = make("div", {
      class: "view", tabindex: 0, role: "group", "aria-label": label, style: `aspect-ratio: ${aspect}`,
    });
    gaze.views.push(this);
    this.listen(wheelZooms);
  }
  add(element, box, frame) {
    this.planes.push({ element, box, frame });
    this.element.append(element);
    this.show();
  }
  reframe(index, frame) {
    this.planes[index].frame = frame;
    this.show();
  }
  clear() {
    this.planes = [];
    this.element.replaceChildren();
  }
  show() {
    const { u, v, zoom } = this.gaze;
    this.element.classList.toggle("near", zoom > 1);
    for (const { element, box, frame } of this.planes) {
      const scale = Math.min(1 / frame.width, 1 / this.aspect / frame.height);
      const left = box.left - frame.left - frame.width / 2;
      const top = box.top - frame.top - frame.height / 2;
      const part = (value) => `${(100 * value).toFixed(4)}%`;
      element.style.left = part(0.5 + (left * scale - u) * zoom);
      element.style.top = part(0.5 + (top * scale * this.aspect - v) * zoom);
      element.style.width = part(box.width * scale * zoom);
      element.style.height = part(box.height * scale * zoom * this.aspect);
    }
  }
  /** A place on the screen as parts of the view from its middle. */
  place(event) {
    const box = this.element.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width - 0.5, (event.clientY - box.top) / box.height - 0.5];
  }
  listen(wheelZooms) {
    const element = this.element;
    const held = new Map();
    const spread = () => {
      const [one, two] = [...held.values()];
      return Math.hypot(one[0] - two[0], (one[1] - two[1]) / this.aspect);
    };
    element.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      element.setPointerCapture(event.pointerId);
      held.set(event.pointerId, this.place(event));
      element.classList.add("held");
    });
    element.addEventListener("pointermove", (event) => {
      const before = held.get(event.pointerId);
      if (!before) return;
      const now = this.place(event);
      const apart = held.size === 2 ? spread() : 0;
      held.set(event.pointerId, now);
      if (held.size === 2 && apart > 0) {
        const [one, two] = [...held.values()];
        this.gaze.zoomBy(spread() / apart, (one[0] + two[0]) / 2, (one[1] + two[1]) / 2);
      } else if (held.size === 1) {
        this.gaze.move(before[0] - now[0], before[1] - now[1]);
      }
    });
    for (const name of ["pointerup", "pointercancel"]) {
      element.addEventListener(name, (event) => {
        held.delete(event.pointerId);
        element.classList.toggle("held", held.size > 0);
      });
    }
    element.addEventListener("wheel", (event) => {
      // Without Ctrl the page scrolls, as pages do.
      if (!wheelZooms && !event.ctrlKey) return;
      event.preventDefault();
      this.gaze.zoomBy(Math.exp(-event.deltaY / 400), ...this.place(event));
    }, { passive: false });
    element.addEventListener("dblclick", (event) => {
      this.gaze.zoomBy(event.shiftKey ? 0.5 : 2, ...this.place(event));
    });
    element.addEventListener("keydown", (event) => {
      if (!isTyping(event) && this.gaze.key(event)) {
        event.preventDefault();
        event.stopPropagation();
      }
    });
  }
}
