// node main.mjs: the tests of the page's modules, without a browser.
import '../support/node18.mjs';
import './camera_test.mjs';
import './link_test.mjs';
import './mannequin_test.mjs';
import './motion_test.mjs';
import './scene_test.mjs';
import './streams_test.mjs';
import './weight_test.mjs';
import './wire_test.mjs';
