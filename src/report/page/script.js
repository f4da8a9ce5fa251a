'use strict';
const make = (tag, properties, parent) => parent.appendChild(Object.assign(document.createElement(tag), properties));

// Lays two pictures of a figure over each other: the left one up to the slider, the right one beyond it, or both by turns.
for (const box of document.querySelectorAll('.compare')) {
  const figures = [...box.parentElement.querySelectorAll('figure.picture')];
  const controls = make('div', { className: 'controls' }, box);
  const select = (label, chosen) => {
    const list = make('select', { ariaLabel: label }, controls);
    figures.forEach((figure, i) => {
      const name = figure.querySelector('.caption').textContent.slice(0, 80);
      make('option', { value: i, textContent: name, selected: i === chosen }, list);
    });
    return list;
  };
  const left = select('left picture', 0);
  const slider = make('input', { type: 'range', min: 0, max: 100, value: 50, ariaLabel: 'where one ends' }, controls);
  const right = select('right picture', 1);
  const blink = make('button', { type: 'button', textContent: 'blink' }, controls);
  const stage = make('div', { className: 'stage' }, box);
  const under = make('img', { alt: '', draggable: false }, stage);
  const over = make('img', { alt: '', className: 'over', draggable: false }, stage);
  const divider = make('div', { className: 'divider' }, stage);
  let timer = 0;
  const show = () => {
    const [a, b] = [figures[left.value], figures[right.value]];
    const [first, second] = [a.querySelector('img'), b.querySelector('img')];
    under.src = second.src;
    over.src = first.src;
    [under.width, under.height] = [second.getAttribute('width'), second.getAttribute('height')];
    stage.classList.toggle('enlarged', b.classList.contains('enlarged'));
    over.style.clipPath = timer ? 'none' : `inset(0 ${100 - slider.value}% 0 0)`;
    divider.style.left = `${slider.value}%`;
    divider.hidden = Boolean(timer);
  };
  for (const control of [left, right, slider]) control.addEventListener('input', show);
  // The divider can be drawn along in the picture, too.
  const draw = (event) => {
    if (event.buttons !== 1 && event.type !== 'pointerdown') return;
    const { left: start, width } = stage.getBoundingClientRect();
    slider.value = (100 * (event.clientX - start)) / width;
    show();
  };
  stage.addEventListener('pointerdown', draw);
  stage.addEventListener('pointermove', draw);
  blink.addEventListener('click', () => {
    if (timer) {
      clearInterval(timer);
      timer = 0;
      over.style.visibility = 'visible';
    } else {
      timer = setInterval(() => {
        over.style.visibility = over.style.visibility === 'hidden' ? 'visible' : 'hidden';
      }, 600);
    }
    blink.textContent = timer ? 'stop' : 'blink';
    show();
  });
  show();
}

// Tells at once what a drawing's mark would tell after a while by itself.
const told = make('div', { className: 'told', hidden: true, role: 'status' }, document.body);
document.addEventListener('pointerover', ({ target, clientX, clientY }) => {
  const spot = target.closest('.spot');
  told.hidden = !spot;
  if (!spot) return;
  told.textContent = spot.querySelector('title').textContent;
  const { width, height } = told.getBoundingClientRect();
  told.style.left = `${Math.max(0, Math.min(clientX + 12, innerWidth - width - 8))}px`;
  told.style.top = `${clientY + 18 + height > innerHeight ? clientY - height - 12 : clientY + 18}px`;
});

// A picture at full size closes with Escape, and the contents once they have led somewhere.
document.addEventListener('keydown', ({ key }) => {
  const close = document.querySelector('.sheet:target .close');
  if (key === 'Escape' && close) close.click();
});
document.querySelector('nav.above').addEventListener('click', ({ target, currentTarget }) => {
  if (target.closest('a')) currentTarget.querySelector('details').open = false;
});
