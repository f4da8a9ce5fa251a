// Lays two pictures of a figure over each other: the left one up to the slider, the right one beyond it, or both by turns.
for (const box of document.querySelectorAll('.compare')) {
  const figures = [...box.parentElement.querySelectorAll('.pictures figure')];
  const make = (tag, properties, parent) => parent.appendChild(Object.assign(document.createElement(tag), properties));
  const controls = make('div', { className: 'controls' }, box);
  const select = (label, chosen) => {
    const list = make('select', { ariaLabel: label }, controls);
    figures.forEach((figure, i) => {
      const name = figure.querySelector('figcaption').firstChild.textContent.slice(0, 80);
      make('option', { value: i, textContent: name, selected: i === chosen }, list);
    });
    return list;
  };
  const left = select('left picture', 0);
  const slider = make('input', { type: 'range', min: 0, max: 100, value: 50, ariaLabel: 'where one ends' }, controls);
  const right = select('right picture', 1);
  const blink = make('button', { type: 'button', textContent: 'blink' }, controls);
  const stage = make('div', { className: 'stage' }, box);
  const under = make('img', { alt: '' }, stage);
  const over = make('img', { alt: '', className: 'over' }, stage);
  let timer = 0;
  const show = () => {
    const [a, b] = [figures[left.value], figures[right.value]];
    under.src = b.querySelector('img').src;
    over.src = a.querySelector('img').src;
    stage.classList.toggle('enlarged', b.classList.contains('enlarged'));
    under.width = b.querySelector('img').width;
    over.style.clipPath = timer ? 'none' : `inset(0 ${100 - slider.value}% 0 0)`;
  };
  for (const control of [left, right, slider]) control.addEventListener('input', show);
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
